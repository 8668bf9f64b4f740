import pytest

from ses_core.errors import SchemaError
from storage.table_schemas import SCHEMA_VERSION, TABLES, VERSION_KEY, table_schema

PROMISED = {
    "logs": "log_id name robot site pose_source format batch_date start_stamp_ns duration_s "
    "path_length_m steps messages_in messages_used warnings",
    "trajectories": "log_id step stamp_ns x_m y_m yaw_rad command_v_mps command_w_radps "
    "measured_v_mps measured_w_radps negative_velocity",
    "scans": "log_id",
    "scenarios": "scenario_id log_id robot site batch_date kind first_step last_step "
    "start_stamp_ns duration_s arc_length_m start_x_m start_y_m start_yaw_rad goal_x_m goal_y_m "
    "negative_velocity_count not_forward_count reversing_s is_challenging",
    "environments": "environment_id scenario_id origin cells observed resolution_m "
    "observed_fraction path_in_free_fraction is_traversable closest_obstacle_m visibility_m "
    "dispersion characteristic_dimension_m tortuosity",
    "selections": "run_id scenario_id rank count_kind",
    "episodes": "episode_id run_id policy world_id pair trial seed outcome time_s path_length_m "
    "optimal_time_s barn_score negative_velocity_count not_forward_count",
    "difficulties": "environment_id policy_id trials negative_velocity_count not_forward_count "
    "success_rate restricted_mean_time_s run_id",
    "policies": "policy_id parent_id run_id algorithm steps seed environments created_stamp_ns "
    "decision",
}


def test_every_promised_column_is_there() -> None:
    assert set(TABLES) == set(PROMISED)
    for table, columns in PROMISED.items():
        assert set(columns.split()) <= set(table_schema(table).names), table


def test_every_file_will_carry_the_schema_version() -> None:
    for table in TABLES:
        assert table_schema(table).metadata[VERSION_KEY] == str(SCHEMA_VERSION).encode()


def test_stamps_are_whole_numbers_and_identities_text() -> None:
    for table in TABLES:
        for field in table_schema(table):
            if field.name.endswith("_ns"):
                assert str(field.type) == "int64"
            if field.name.endswith("_id"):
                assert str(field.type) == "string"


def test_an_unknown_table_is_named_with_the_known_ones() -> None:
    with pytest.raises(SchemaError, match=r"'runs', expected one of logs, trajectories"):
        table_schema("runs")
