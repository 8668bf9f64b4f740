"""Tests of difficulties on disk: rows come back, and the tables say what is known already."""

import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from ses_core.evaluation.difficulty import VerifiedDifficulty
from ses_core.recipes import Recipe
from storage.artifact_store import LocalArtifactStore
from storage.difficulty_files import (
    known_difficulties,
    logged_headings,
    read_conditions,
    read_difficulties,
    write_difficulties,
)
from storage.parquet_files import write_table
from storage.stages import REPORT
from storage.table_log import TableLog
from storage.table_parts import artifact_parts
from tests.ses_core.synthesis.places import domain_of
from tests.storage.sample_tables import DAY, sample_columns


def row(name: str) -> VerifiedDifficulty:
    return VerifiedDifficulty(
        environment_id=name,
        policy_id="p",
        trials=3,
        negative_velocity_count=1 / 3,
        not_forward_count=2.5,
        success_rate=2 / 3,
        restricted_mean_time_s=41.2,
    )


@pytest.fixture
def store(tmp_path: Path) -> LocalArtifactStore:
    return LocalArtifactStore(tmp_path / "store")


def test_rows_come_back_as_they_were_written(tmp_path: Path) -> None:
    write_difficulties(tmp_path, [row("e"), row("f")], conditions="c", run_id="night")
    assert read_difficulties(tmp_path) == [row("e"), row("f")]
    assert read_conditions(tmp_path) == "c"
    write_difficulties(tmp_path, [], conditions="c")
    assert (read_difficulties(tmp_path), read_conditions(tmp_path)) == ([], "")


def test_only_what_was_driven_under_the_same_conditions_is_known(
    store: LocalArtifactStore,
) -> None:
    assert known_difficulties(store.layout.root, "c") == {}
    log = TableLog(store.layout)
    for night, conditions in (("one", "c"), ("two", "other")):
        build = partial(write_difficulties, rows=[row(night)], conditions=conditions, run_id=night)
        made = store.put(Recipe(REPORT, {"night": night}), build)
        log.commit(artifact_parts(store, made, name=night, batch_date=DAY), message=night)
    assert known_difficulties(store.layout.root, "c") == {"one": row("one")}


def test_headings_are_those_of_the_scenarios(store: LocalArtifactStore) -> None:
    """Three scenarios along y: straight on, to the left, and away from the goal."""

    def build(folder: Path) -> None:
        columns = sample_columns("scenarios")
        columns |= {
            "scenario_id": ["s0", "s1", "s9"],
            "start_x_m": [2.0] * 3,
            "start_y_m": [1.0] * 3,
            "goal_x_m": [2.0] * 3,
            "goal_y_m": [6.0] * 3,
            "start_yaw_rad": [math.pi / 2, math.pi, -math.pi / 2],
        }
        write_table(folder / "scenarios.parquet", "scenarios", columns)

    made = store.put(Recipe(REPORT, {"log": "a"}), build)
    TableLog(store.layout).commit(
        artifact_parts(store, made, name="a", batch_date=DAY), message="log a"
    )
    places = domain_of(np.zeros((3, 30, 30), dtype=np.bool_)).environments
    found = logged_headings(store.layout.root, places)
    assert found == {"e0": pytest.approx(0.0), "e1": pytest.approx(math.pi / 2)}
