"""`ses show episode`: the very trial of an evaluation, by its id or by what it is."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flows.command_line import run
from ses_core.evaluation.episodes import Episode
from ses_core.evaluation.places import sampled_places
from ses_core.evaluation.trials import evaluate
from ses_core.learning.policies import FIXED_POLICIES
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.settings import Settings
from ses_core.worlds.identity import named_world
from storage.evaluation_files import write_evaluation
from storage.parquet_files import read_table, write_table
from storage.settings_file import read_settings
from storage.world_sets import write_world_set

SETTINGS = "[simulation]\ntime_limit_s = 6.0\n[evaluation]\npairs = 2\ntrials = 3\nseed = 7\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Worlds, an evaluation in them, and the settings of both."""
    made = tmp_path_factory.mktemp("shown")
    (made / "ses.toml").write_text(SETTINGS, encoding="utf-8")
    settings = read_settings(made / "ses.toml")
    worlds = [room("narrow", 3.0), room("wide", 5.0)]
    write_world_set(made / "worlds", worlds)
    write_evaluation(made / "measured", episodes(worlds, settings))
    return made


def room(name: str, width: float) -> World:
    """A room 10 m long with a pillar in it."""
    cells = np.zeros((round(width / 0.1), 100), dtype=np.bool_)
    cells[[0, -1]] = True
    cells[:, [0, -1]] = True
    cells[12:16, 48:52] = True
    return named_world(name, OccupancyGrid(cells=cells, resolution=0.1), source="test")


def episodes(worlds: list[World], settings: Settings) -> list[Episode]:
    return evaluate(
        FIXED_POLICIES,
        sampled_places(worlds, settings=settings.evaluation, profile=settings.target_robot),
        trials=settings.evaluation.trials,
        seed=settings.evaluation.seed,
        simulation=settings.simulation,
        profile=settings.target_robot,
    )


def rows(folder: Path) -> list[dict[str, Any]]:
    frame = read_table(folder / "measured" / "episodes.parquet", "episodes")
    return [{str(name): value for name, value in row.items()} for row in frame.to_dict("records")]


def show(folder: Path, *arguments: str) -> int:
    worlds = ["--worlds", str(folder / "worlds"), "--settings", str(folder / "ses.toml")]
    return run(["show", "episode", *worlds, *arguments])


def facts(folder: Path, capfd: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    capfd.readouterr()
    assert show(folder, "--json", *arguments) == 0
    found: dict[str, Any] = json.loads(capfd.readouterr().out)
    return found


def test_a_trial_that_options_describe_is_that_of_the_table(
    folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "deeper" / "it.png"
    described = ["--world", "wide", "--pair", "1", "--trial", "2", "--policy", "dwa-fast"]
    told = facts(folder, capfd, *described, "--out", str(picture))

    (row,) = [
        row
        for row in rows(folder)
        if (row["policy"], row["pair"], row["trial"]) == ("dwa-fast", 1, 2)
        and row["world_id"].startswith("wide")
    ]
    assert {name: told[name] for name in row} == row
    assert told["picture"] == str(picture)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert told["reversing_s"] == pytest.approx(0.05 * row["negative_velocity_count"])


def test_an_episode_is_found_by_its_id_and_looked_at_when_asked(
    folder: Path,
    capfd: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    row = rows(folder)[4]
    evaluation = ["--evaluation", str(folder / "measured"), "--at", "1.5"]
    told = facts(folder, capfd, row["episode_id"], *evaluation)

    assert {name: told[name] for name in row} == row
    assert told["at_s"] == pytest.approx(1.4)
    assert told["picture"] == str(tmp_path / f"{row['episode_id']}.png")


def test_another_drive_than_the_recorded_one_is_not_drawn(
    folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other.toml"
    other.write_text(
        '[simulation]\nimperfections = "double"\ntime_limit_s = 6.0\n', encoding="utf-8"
    )
    picture = tmp_path / "it.png"
    evaluation = ["--evaluation", str(folder / "measured"), "--out", str(picture)]
    row = rows(folder)[0]

    assert show(folder, "--settings", str(other), row["episode_id"], *evaluation) == 1
    line = capfd.readouterr().err
    assert line.count("\n") == 1
    assert row["episode_id"] in line
    assert "driven again" in line
    assert not picture.exists()


@pytest.mark.parametrize(
    ("line", "found", "expected"),
    [
        ("--world nowhere", "--world: found 'nowhere'", "expected one of 2 worlds: narrow-"),
        ("--policy nobody", "'nobody'", "dwa-slow"),
        ("--pair -1", "'-1'", "greater than or equal to 0"),
        ("--min-distance 50", "50 m", "narrow-"),
        ("--at 99", "99 s", "expected 0 to "),
        ("--simulator gazebo", "'gazebo'", "'batch', 'bullet'"),
        ("0f3c", "no --evaluation", "EPISODE_ID"),
        ("--evaluation MEASURED", "no EPISODE_ID", "--evaluation"),
        ("0f3c --evaluation MEASURED", "'0f3c'", "24 episodes"),
        ("0f3c --evaluation MEASURED --trial 1", "--trial: found it beside", "one of the two"),
        ("0f3c --evaluation WORLDS", "is missing", "a file of table episodes"),
        ("0f3c --evaluation /none", "nothing at /none", "a folder"),
        ("0f3c 1a2b", "'1a2b'", "nothing more"),
    ],
)
def test_misuse_is_one_line_with_what_was_found_and_expected(
    line: str,
    found: str,
    expected: str,
    folder: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    named = {"MEASURED": str(folder / "measured"), "WORLDS": str(folder / "worlds")}

    assert show(folder, *(named.get(word, word) for word in line.split())) == 2
    written = capfd.readouterr()
    assert written.out == ""
    assert written.err.count("\n") == 1
    assert found in written.err
    assert expected in written.err
    assert not list(tmp_path.iterdir())


def test_a_world_of_the_evaluation_has_to_be_given(
    folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    write_world_set(tmp_path / "other", [room("other", 4.0)])
    row = rows(folder)[0]
    asked = ["--worlds", str(tmp_path / "other"), "--evaluation", str(folder / "measured")]

    assert run(["show", "episode", row["episode_id"], *asked]) == 2
    assert f"expected {row['world_id']}" in capfd.readouterr().err


def test_an_evaluation_that_kept_no_starts_is_refused(
    folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    kept = rows(folder)
    columns = [name for name in kept[0] if name[:5] not in {"start", "goal_", "simul"}]
    older = {name: [row[name] for row in kept] for name in columns}
    write_table(tmp_path / "episodes.parquet", "episodes", older)

    assert show(folder, kept[0]["episode_id"], "--evaluation", str(tmp_path)) == 2
    assert "without start and goal" in capfd.readouterr().err


def test_help_has_an_example_and_the_way_to_it(capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["show", "episode", "--help"]) == 0
    assert "Example: ses show episode" in capfd.readouterr().out
    assert run(["show", "--help"]) == 0
    assert "ses show episode --help" in " ".join(capfd.readouterr().out.split())
