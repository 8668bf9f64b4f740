"""Scenarios and environments on disk: what is written is what is read."""

import math
from pathlib import Path

import numpy as np
import pandas as pd

from ses_core.extraction.difficulty import DifficultyMeasures
from ses_core.extraction.extract import ExtractedScenario, PlaceQuality
from ses_core.extraction.scenario import Scenario
from ses_core.extraction.selection import select_challenging
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationEnvironment
from ses_core.settings import FilterSettings
from storage.scenario_tables import (
    ENVIRONMENTS_FILE,
    SCENARIOS_FILE,
    environments_of,
    read_environments,
    read_scenarios,
    write_extracted,
)


def extracted(number: int, *, count: int | None, has_place: bool = True) -> ExtractedScenario:
    identity = f"scenario-{number}"
    rng = np.random.default_rng(number)
    scenario = Scenario(
        kind="scenario",
        first_step=100 * number,
        last_step=100 * number + 100,
        start_stamp_ns=1_700_000_000_123_456_789 + number,
        duration_s=5.0 if count is not None else math.nan,
        arc_length_m=6.5,
        start=Pose2D(1.5, -2.5, 0.25),
        goal=(6.5, -1.25),
        negative_velocity_count=count,
        not_forward_count=count,
        reversing_s=None if count is None else count / 20.0,
    )
    if not has_place:
        return ExtractedScenario(
            scenario_id=identity, scenario=scenario, environment=None, quality=None
        )
    environment = NavigationEnvironment(
        environment_id=f"environment-{number}",
        cells=rng.random((30, 30)) < 0.2,
        observed=rng.random((30, 30)) < 0.7,
        origin="scan",
        scenario_id=identity,
    )
    difficulty = DifficultyMeasures(
        closest_obstacle=0.5,
        visibility=1.5,
        dispersion=2.5,
        characteristic_dimension=1.25,
        tortuosity=1.125,
    )
    quality = PlaceQuality(
        observed_fraction=0.7,
        path_in_free_fraction=0.95,
        overridden_cells=number,
        contradicted_fraction=0.125,
        is_traversable=number % 2 == 0,
        difficulty=difficulty if number % 2 == 0 else None,
    )
    return ExtractedScenario(
        scenario_id=identity, scenario=scenario, environment=environment, quality=quality
    )


def write(directory: Path, rows: list[ExtractedScenario], *, log_id: str = "log") -> Path:
    directory.mkdir()
    write_extracted(
        directory,
        log_id=log_id,
        robot="r1",
        site="home",
        batch_date="2026-11-22",
        extracted=rows,
        filter_settings=FilterSettings(),
    )
    return directory


ROWS = [
    extracted(0, count=51),
    extracted(1, count=50),
    extracted(2, count=None),
    extracted(3, count=99, has_place=False),
]


def test_columns_are_those_of_the_scenarios_and_null_is_not_zero(tmp_path: Path) -> None:
    directory = write(tmp_path / "log", ROWS)
    found = pd.read_parquet(directory / SCENARIOS_FILE)
    assert list(found["scenario_id"]) == [row.scenario_id for row in ROWS]
    assert found["negative_velocity_count"].isna().tolist() == [False, False, True, False]
    assert found["negative_velocity_count"].dtype == "Int64"
    assert found["is_challenging"].tolist() == [True, False, False, True]
    assert found["start_stamp_ns"].tolist() == [row.scenario.start_stamp_ns for row in ROWS]
    assert found["environment_id"].isna().tolist() == [False, False, False, True]
    places = found[["start_x_m", "start_y_m", "start_yaw_rad", "goal_x_m", "goal_y_m"]]
    assert places.to_numpy()[0].tolist() == [1.5, -2.5, 0.25, 6.5, -1.25]
    assert set(found["batch_date"]) == {"2026-11-22"}


def test_environments_come_back_equal(tmp_path: Path) -> None:
    directory = write(tmp_path / "log", ROWS)
    rows = read_environments([directory / ENVIRONMENTS_FILE])
    for written, found in zip(ROWS[:3], environments_of(rows), strict=True):
        assert written.environment is not None
        assert found.environment_id == written.environment.environment_id
        assert found.scenario_id == written.scenario_id
        assert found.origin == "scan"
        assert (found.cells == written.environment.cells).all()
        assert (found.observed == written.environment.observed).all()
    assert rows["is_traversable"].tolist() == [True, False, True]
    assert rows["overridden_cells"].tolist() == [0, 1, 2]
    assert rows["tortuosity"].isna().tolist() == [False, True, False]
    assert rows.loc[0, "characteristic_dimension_m"] == 1.25


def test_tables_of_several_logs_go_through_the_filter(tmp_path: Path) -> None:
    first = write(tmp_path / "first", ROWS)
    empty = write(tmp_path / "empty", [], log_id="empty")
    second = write(tmp_path / "second", [extracted(4, count=200)], log_id="second")
    folders = [first, empty, second]
    selection = select_challenging(
        read_scenarios(folder / SCENARIOS_FILE for folder in folders),
        read_environments(folder / ENVIRONMENTS_FILE for folder in folders),
        settings=FilterSettings(heldout_share=0.0),
        last_batch=pd.Timestamp("2026-11-22").date(),
    )
    assert selection.pool["scenario_id"].tolist() == ["scenario-4", "scenario-0"]
    assert selection.funnels["negative"].rejected == {"no_environment": 1}
    assert selection.funnels["negative"].unknown == 1


def test_logs_without_scenarios_give_an_empty_selection(tmp_path: Path) -> None:
    empty = write(tmp_path / "empty", [])
    for folders in ([empty], []):
        selection = select_challenging(
            read_scenarios(folder / SCENARIOS_FILE for folder in folders),
            read_environments(folder / ENVIRONMENTS_FILE for folder in folders),
            settings=FilterSettings(),
            last_batch=pd.Timestamp("2026-11-22").date(),
        )
        assert selection.pool.empty
        assert selection.funnels["not-forward"].scenarios == 0
