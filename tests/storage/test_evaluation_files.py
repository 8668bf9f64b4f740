"""Tests of evaluations on disk."""

import json
from pathlib import Path

import pandas as pd

from storage.evaluation_files import read_episodes, write_evaluation
from tests.ses_core.evaluation.episode_lists import episode, successes

EPISODES = [
    *successes("new", [10.0, 20.0, 30.0]),
    *successes("old", [11.0, 22.0]),
    episode("old", "world-2", "collision", 4.0),
]


def test_episodes_read_back_as_written(tmp_path: Path) -> None:
    write_evaluation(tmp_path, EPISODES)
    assert read_episodes(tmp_path) == EPISODES


def test_pandas_opens_the_episodes(tmp_path: Path) -> None:
    write_evaluation(tmp_path, EPISODES)
    frame = pd.read_parquet(tmp_path / "episodes.parquet")
    assert frame["outcome"].tolist() == ["success"] * 5 + ["collision"]


def test_the_summary_has_the_public_keys(tmp_path: Path) -> None:
    write_evaluation(tmp_path, EPISODES)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert [row["policy"] for row in summary["rows"]] == ["new", "old"]
    assert {
        "policy",
        "success_rate",
        "success_ci",
        "mean_time_s",
        "restricted_mean_time_s",
        "collision_rate",
        "timeout_rate",
        "stuck_rate",
        "barn_score",
        "trials",
    } <= set(summary["rows"][0])
    [comparison] = summary["comparisons"]
    assert (comparison["policy"], comparison["baseline"]) == ("new", "old")
    assert {"success_difference", "ci", "time_difference_s", "ci_s"} <= set(comparison)
