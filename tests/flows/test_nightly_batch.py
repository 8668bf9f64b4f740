"""The whole night through the command, on a simulated fleet: built once, found ever after."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from ses_core.learning.policies import ParameterPolicy
from storage.policy_files import ORIGINAL_FOLDER, read_policy
from storage.table_reader import open_table
from storage.table_schemas import TABLES
from tests.simulated_fleet import DAY, write_fleet

pytestmark = [pytest.mark.xdist_group("night"), pytest.mark.timeout(600)]

SETTINGS = """
[[ingest.robots]]
match = "*"
profile = "jackal"

[filter]
challenging_share = 0.9
min_observed_fraction = 0.1

[synthesis]
environments = 4
least_pool = 1
synthesizer = { method = "rs" }

[scorecard]
halvings = 4
permutations = 19
driven = 2

[difficulty]
trials = 1
recorded = 3

[training]
steps = 400
parallel_envs = 8
difficulty = "weigh"

[evaluation]
trials = 2
spot_checks = 1
"""


@dataclass(frozen=True)
class Fleet:
    """An inbox, a settings file and a store."""

    inbox: Path
    settings: Path
    root: Path

    def command(self, *arguments: str) -> list[str]:
        ses = [sys.executable, "-m", "flows.command_line", *arguments]
        return [*ses, "--root", str(self.root), "--settings", str(self.settings), "--json"]

    def night(self, *options: str) -> dict[str, Any]:
        arguments = ["nightly", "--inbox", str(self.inbox), "--date", DAY.isoformat(), *options]
        answer = subprocess.run(self.command(*arguments), capture_output=True, text=True)
        assert answer.returncode == 0, answer.stderr
        summary: dict[str, Any] = json.loads(answer.stdout)
        return summary


@pytest.fixture(scope="session")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Fleet:
    folder = tmp_path_factory.mktemp("fleet")
    assert write_fleet(folder / "inbox") == 8
    (folder / "ses.toml").write_text(SETTINGS, encoding="utf-8")
    return Fleet(folder / "inbox", folder / "ses.toml", folder / "store")


@pytest.fixture(scope="session")
def first(fleet: Fleet) -> dict[str, Any]:
    return fleet.night()


def built(summary: dict[str, Any]) -> dict[str, int]:
    return {name: stage["built"] for name, stage in summary["stages"].items() if stage["built"]}


def read_tables(root: Path) -> dict[str, pd.DataFrame]:
    return {table: pd.read_parquet(root / "tables" / table) for table in TABLES}


def test_a_night_goes_from_bags_to_a_judged_policy_and_a_page(
    fleet: Fleet, first: dict[str, Any]
) -> None:
    assert first["logs"] == {
        "new": 8,
        "known": 0,
        "quarantined": 0,
        "waiting": 0,
        "ignored": 8,
        "unknown_robot": 0,
    }
    assert first["scenarios"] > 0
    assert 0 < first["environments"] <= 4
    assert set(built(first)) == set(first["stages"])
    assert first["decisions_trained"] >= 300
    policies = [row["policy"] for row in first["evaluation"]]
    assert policies == [first["run_id"], "original", "dwa-slow", "dwa-fast"]
    assert len({row["trials"] for row in first["evaluation"]}) == 1
    assert [row["baseline"] for row in first["comparisons"]] == policies[1:]
    assert first["decision"] == "insufficient-evidence"
    assert first["champion"] == read_policy(ORIGINAL_FOLDER).policy_id
    page = Path(first["report"]).read_text(encoding="utf-8")
    assert first["run_id"] in page
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_a_night_says_how_well_its_environments_stand_for_the_pool(
    fleet: Fleet, first: dict[str, Any]
) -> None:
    rows = {row["metric"]: row for row in first["scorecard"]}
    assert rows["traversable, shipped"]["value"] == 1.0
    assert rows["traversable, raw"]["value"] <= 1.0
    assert rows["mean time"]["feature"] == "drives of dwa-slow"
    assert rows["mean time"]["value"] > 0.0
    assert all(row["note"] for row in first["scorecard"] if row["value"] is None)
    report = Path(first["report"])
    table = pd.read_parquet(report.parent / "scorecard.parquet")
    assert table.metric.to_list() == [row["metric"] for row in first["scorecard"]]
    pool = (read_tables(fleet.root)["selections"].run_id == first["run_id"]).sum()
    assert table.set_index("metric").loc["traversable, shipped", "n_real"] == pool
    page = report.read_text(encoding="utf-8")
    assert "Do these environments stand for those?" in page
    assert page.count('<tr class="group">') == 5


def test_a_night_drives_again_where_robots_struggled(fleet: Fleet, first: dict[str, Any]) -> None:
    tables = read_tables(fleet.root)
    rows = tables["difficulties"][tables["difficulties"].run_id == first["run_id"]]
    assert set(rows.policy_id) == {first["champion"]}
    assert set(rows.trials) == {1}
    selected = tables["selections"][tables["selections"].run_id == first["run_id"]]
    hardest = selected.sort_values("rank").environment_id.to_list()[:3]
    synthesized = tables["environments"][tables["environments"].run_id == first["run_id"]]
    assert sorted(rows.environment_id) == sorted({*hardest, *synthesized.environment_id})
    page = Path(first["report"]).read_text(encoding="utf-8")
    assert "Are they as hard as the log says?" in page
    assert "difficulty/" in page


def test_the_nights_rows_stand_in_every_table(fleet: Fleet, first: dict[str, Any]) -> None:
    tables = read_tables(fleet.root)
    assert len(tables["logs"]) == 8
    assert (tables["scenarios"].kind == "scenario").sum() == first["scenarios"]
    for table in ("selections", "difficulties", "episodes", "policies"):
        assert set(tables[table].run_id) == {first["run_id"]}
    (policy,) = tables["policies"].to_dict("records")
    assert policy["policy_id"] == first["policy"]
    assert policy["parent_id"] == first["champion"]
    synthesized = tables["environments"][tables["environments"].run_id == first["run_id"]]
    assert len(synthesized) == first["environments"]
    assert synthesized.is_traversable.all()
    counts = tables["episodes"].groupby(["policy", "simulator"]).size()
    assert counts[first["run_id"], "batch"] == first["evaluation"][0]["trials"]
    assert counts[first["run_id"], "bullet"] == 1


def test_the_pages_galleries_hold_every_place_of_the_night(
    fleet: Fleet, first: dict[str, Any]
) -> None:
    tables = read_tables(fleet.root)
    page = Path(first["report"]).read_text(encoding="utf-8")
    recorded, trained_in = (
        json.loads(data)
        for data in re.findall(r'<script type="application/json">(.*?)</script>', page)
    )
    scenarios = tables["scenarios"].set_index("environment_id")
    whole = scenarios[(scenarios.kind == "scenario") & pd.notna(scenarios.index)]
    assert sorted(recorded["id"]) == sorted(whole.index)
    selected = tables["selections"][tables["selections"].run_id == first["run_id"]]
    chosen = selected.sort_values("rank").environment_id.to_list()
    assert recorded["id"][: len(chosen)] == chosen
    assert recorded["chosen"] == [int(one in chosen) for one in recorded["id"]]
    counts = whole.loc[recorded["id"], "negative_velocity_count"].to_list()
    assert recorded["count"] == counts
    sites = [recorded["sites"][number] for number in recorded["site"]]
    assert sites == whole.loc[recorded["id"], "site"].to_list()
    places = tables["environments"].set_index("environment_id").loc[recorded["id"]]
    assert recorded["traversable"] == places.is_traversable.astype(int).to_list()
    assert recorded["occupied"] == [int(cells.sum()) for cells in places.cells]
    assert len(trained_in["id"]) == first["environments"]


def test_training_changed_weights_and_behaviour(fleet: Fleet, first: dict[str, Any]) -> None:
    (folder,) = (path.parent for path in (fleet.root / "objects/train").glob("*/policy.json"))
    ours, original = read_policy(folder).policy, read_policy(ORIGINAL_FOLDER).policy
    assert isinstance(ours, ParameterPolicy)
    assert any((a != b).any() for a, b in zip(ours.weights, original.weights, strict=True))
    observations = np.random.default_rng(0).uniform(
        -0.5, 0.5, (50, ours.observation.length(ours.action))
    )
    assert np.abs(ours.act(observations) - original.act(observations)).max() > 1e-6


def test_a_second_night_builds_nothing_and_says_the_same(
    fleet: Fleet, first: dict[str, Any]
) -> None:
    before = {path: path.stat().st_mtime_ns for path in fleet.root.glob("batches/*")}
    second = fleet.night()
    assert built(second) == {}
    assert second["logs"]["known"] == 8
    for key in (
        "run_id",
        "scenarios",
        "environments",
        "scorecard",
        "evaluation",
        "decision",
        "policy",
    ):
        assert second[key] == first[key]
    assert {path: path.stat().st_mtime_ns for path in fleet.root.glob("batches/*")} == before


def test_refreshing_a_stage_builds_it_and_what_follows_but_nothing_before(
    fleet: Fleet, first: dict[str, Any]
) -> None:
    again = fleet.night("--refresh", "evaluate")
    assert set(built(again)) == {"evaluate", "report"}
    assert again["evaluation"] == first["evaluation"]


def test_a_killed_night_shows_whole_tables_and_repeats_nothing_finished(
    fleet: Fleet, first: dict[str, Any], tmp_path: Path
) -> None:
    killed = Fleet(fleet.inbox, fleet.settings, tmp_path / "store")
    arguments = ["nightly", "--inbox", str(fleet.inbox), "--date", DAY.isoformat()]
    taken: list[int] = []
    for enough in (1, 4, 8):
        _kill_when(killed.command(*arguments), killed.root, logs=enough)
        assert len(read_tables(killed.root)["logs"]) >= enough
        # A plain reader may find a log in one table a moment before the other: what is
        # committed together is together for whoever goes by the log of the tables.
        logs = set(open_table(killed.root, "logs").log_id)
        assert set(open_table(killed.root, "trajectories").log_id) == logs
        assert set(open_table(killed.root, "scenarios").log_id) <= logs
        taken.append(len(logs))
    last = killed.night()
    assert last["stages"]["ingest"]["found"] >= taken[-1]
    assert last["scenarios"] == first["scenarios"]
    undisturbed, disturbed = read_tables(fleet.root), read_tables(killed.root)
    for table, key in (("trajectories", ["log_id", "step"]), ("scenarios", ["scenario_id"])):
        pd.testing.assert_frame_equal(
            disturbed[table].sort_values(key, ignore_index=True),
            undisturbed[table].sort_values(key, ignore_index=True),
        )


def _kill_when(command: Sequence[str], root: Path, *, logs: int) -> None:
    """Start a night and kill all of it as soon as so many logs stand in the table."""
    night = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        deadline = time.monotonic() + 120.0
        while time.monotonic() < deadline and night.poll() is None:
            if len(list((root / "tables/logs").glob(f"{'[0-9a-f]' * 64}.parquet"))) >= logs:
                break
            time.sleep(0.02)
    finally:
        os.killpg(night.pid, signal.SIGKILL)
        night.wait()


def test_a_night_for_another_robot_trains_measures_and_shows_that_one(
    fleet: Fleet, first: dict[str, Any], tmp_path: Path
) -> None:
    other = Fleet(fleet.inbox, tmp_path / "ses.toml", tmp_path / "store")
    short = SETTINGS.replace("steps = 400", "steps = 64")
    other.settings.write_text(f'target_robot = "turtlebot4"\n{short}', encoding="utf-8")
    night = other.night()
    assert night["run_id"] != first["run_id"]
    (folder,) = (path.parent for path in (other.root / "objects/train").glob("*/policy.json"))
    assert read_policy(folder).robot == "turtlebot4"
    page = Path(night["report"]).read_text(encoding="utf-8")
    assert "<strong>turtlebot4</strong>" in page
    assert 'alt="footprint of turtlebot4"' in page
    # One that can only drive at 0.46 m/s was measured: fast parameters make no Jackal of it.
    speeds = {
        root: (episodes.path_length_m / episodes.time_s).max()
        for root in (fleet.root, other.root)
        for episodes in [pd.read_parquet(root / "tables/episodes")]
    }
    assert speeds[other.root] < 0.5 < speeds[fleet.root]


def test_one_more_log_is_the_only_one_decoded_and_extracted(
    fleet: Fleet, first: dict[str, Any], tmp_path: Path
) -> None:
    write_fleet(tmp_path, homes=1, drives=1, seed=11)
    (tmp_path / next(tmp_path.iterdir()).name).rename(fleet.inbox / "home-new")
    more = fleet.night()
    stages = more["stages"]
    assert {name: stages["ingest"][name] for name in ("built", "found")} == {"built": 1, "found": 8}
    assert {name: stages["extract"][name] for name in ("built", "found")} == {
        "built": 1,
        "found": 8,
    }
    assert more["run_id"] != first["run_id"]
    assert len(pd.read_parquet(fleet.root / "tables/logs")) == 9
