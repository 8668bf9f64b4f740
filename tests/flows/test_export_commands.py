"""`ses export` as a user meets it: what is written, what it says, and how it refuses."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from flows.command_line import run
from flows.export_commands import SUFFIXES
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from ses_core.occupancy import environment_to_grid
from ses_core.robot_profile import JACKAL
from storage.environment_files import write_environments
from storage.table_reader import open_table
from storage.world_sets import read_worlds
from tests.flows.filled_store import fill_store
from tests.log_factory import drive, without


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("filled")
    fill_store(folder / "store", folder / "inbox", without(drive(40.0, speed=0.5), "map"))
    return folder / "store"


@pytest.fixture(scope="module")
def scenario(root: Path) -> dict[str, Any]:
    rows = open_table(root, "scenarios")
    return {str(key): value for key, value in rows[rows["kind"] == "scenario"].iloc[0].items()}


def written(capfd: pytest.CaptureFixture[str], *arguments: str) -> Path:
    capfd.readouterr()
    assert run(["export", *arguments, "--json"]) == 0
    answer = json.loads(capfd.readouterr().out)
    assert set(answer) == {"path"}
    return Path(answer["path"])


def refusal(capfd: pytest.CaptureFixture[str], *arguments: str, status: int = 2) -> str:
    capfd.readouterr()
    assert run(["export", *arguments]) == status
    line = capfd.readouterr().err
    assert line.count("\n") == 1
    return line


@pytest.mark.parametrize("export_format", ["sdf", "map-server", "png", "npz"])
def test_a_scenario_stands_for_its_place_in_every_format(
    export_format: str,
    root: Path,
    scenario: dict[str, Any],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    named = ("--root", str(root), "--format", export_format, "--out")
    of_scenario = written(capfd, scenario["scenario_id"][:9], *named, str(tmp_path / "a" / "place"))
    of_place = written(capfd, scenario["environment_id"], *named, str(tmp_path / "b" / "place"))
    assert of_scenario == tmp_path / "a" / f"place{SUFFIXES[export_format][0]}"  # type: ignore[index]
    assert of_scenario.read_bytes() == of_place.read_bytes()
    (world,) = read_worlds([of_place], resolution=5.0 / 30.0)
    rows = open_table(root, "environments").set_index("environment_id")
    row = rows.loc[scenario["environment_id"]]
    cells = environment_to_grid(np.asarray(row["cells"]).astype(bool)).cells
    if export_format in ("sdf", "npz"):
        assert np.array_equal(world.grid.cells, cells)
    else:
        assert 0 < world.grid.cells.size <= 32 * 32


def test_a_scenario_as_mcap_is_its_drive_and_an_environment_its_grid(
    root: Path, scenario: dict[str, Any], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    topics = {}
    for name in ("scenario_id", "environment_id"):
        path = written(
            *(capfd, scenario[name], "--root", str(root)),
            *("--format", "mcap", "--out", str(tmp_path / f"{name}.mcap")),
        )
        with path.open("rb") as stream:
            topics[name] = {
                channel.topic: message.log_time
                for _, channel, message in make_reader(stream).iter_messages()
            }
    assert set(topics["environment_id"]) == {"/map", "/markers"}
    assert {"/path", "/tf", "/odom", "/scan", "/map", "/markers"} <= set(topics["scenario_id"])
    begin, end = scenario["start_stamp_ns"] - 10**9, scenario["duration_s"] * 1e9 + 10**9
    assert all(begin <= stamp <= begin + 10**9 + end for stamp in topics["scenario_id"].values())


def test_worlds_and_synthesized_environments_need_no_store(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    nowhere = ("--root", str(tmp_path / "nowhere"))
    assert run(["worlds", "generate", "barn", "--count", "2", "--out", str(tmp_path / "set")]) == 0
    first, second = read_worlds([tmp_path / "set"])
    for named in (second.world_id, second.name, second.world_id[:-3]):
        path = written(
            *(capfd, named, *nowhere, "--worlds", str(tmp_path / "set")),
            *("--format", "sdf", "--out", str(tmp_path / "b.world")),
        )
        (found,) = read_worlds([path])
        assert np.array_equal(found.grid.cells, second.grid.cells)
        assert found.course == second.course
    refused = refusal(
        *(capfd, first.world_id[:3], *nowhere, "--worlds", str(tmp_path / "set")),
        *("--format", "sdf", "--out", str(tmp_path / "c.world")),
    )
    assert "which 2 ids begin with" in refused
    cells = np.random.default_rng(0).random((30, 30)) < 0.1
    environment = NavigationEnvironment(
        environment_id="ab12cd34", cells=cells, observed=np.ones_like(cells), origin="gan"
    )
    write_environments(tmp_path, NavigationDomain((environment,)), target=JACKAL)
    listed = (*nowhere, "--environments", str(tmp_path), "--format", "npz")
    path = written(capfd, "ab", *listed, "--out", str(tmp_path / "d.npz"))
    (found,) = read_worlds([path])
    assert np.array_equal(found.grid.cells, environment_to_grid(cells).cells)
    path = written(capfd, "ab", *listed, "--course", "--out", str(tmp_path / "e.npz"))
    (found,) = read_worlds([path])
    assert found.grid.cells.shape == (32, 44)
    assert found.grid.cells[0].all()


def test_misuse_says_in_one_line_what_was_found_and_expected(
    root: Path, scenario: dict[str, Any], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    identity = scenario["scenario_id"]
    stored = ("--root", str(root), "--format")
    out = ("--out", str(tmp_path / "x"))
    unknown = refusal(capfd, "zzz", *stored, "png", *out)
    assert "expected the id of a scenario or an environment, or its beginning" in unknown
    for option, value in (("--part", "fit"), ("--resolution", "0.1")):
        lone = refusal(capfd, identity, *stored, "png", *out, option, value)
        assert f"{option}: found {value} without --worlds, expected" in lone
    assert "found ''" in refusal(capfd, "", *stored, "png", *out)
    assert "a log" in refusal(capfd, scenario["log_id"], *stored, "png", *out)
    assert "'map-server'" in refusal(capfd, identity, *stored, "gif", *out)
    wrong = refusal(capfd, identity, *stored, "sdf", "--out", str(tmp_path / "x.png"))
    assert "expected a name that ends in .world or .sdf" in wrong
    (tmp_path / "y.png").mkdir()
    assert "a folder" in refusal(capfd, identity, *stored, "png", "--out", str(tmp_path / "y.png"))
    assert "no store" in refusal(
        *(capfd, identity, "--root", str(tmp_path / "nowhere"), "--format", "png", *out)
    )
    assert "found nothing" in refusal(
        *(capfd, identity, "--worlds", str(tmp_path / "gone"), "--format", "png", *out)
    )
    assert "no world" in refusal(
        *(capfd, identity, "--worlds", str(tmp_path), "--format", "png", *out)
    )
    assert "mcap" in refusal(capfd, identity, *stored, "mcap", "--course", *out)
    assert not list(tmp_path.glob("x*"))


def test_a_scenario_of_unknown_place_is_refused_but_its_drive_is_not(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    fill_store(tmp_path / "store", tmp_path / "inbox")
    rows = open_table(tmp_path / "store", "scenarios")
    assert rows["environment_id"].isna().all()
    asked = (rows["scenario_id"].iloc[0], "--root", str(tmp_path / "store"))
    line = refusal(capfd, *asked, "--format", "png", "--out", str(tmp_path / "x.png"))
    assert "neither scans nor a map show anything" in line
    path = written(capfd, *asked, "--format", "mcap", "--out", str(tmp_path / "x.mcap"))
    with path.open("rb") as stream:
        topics = {channel.topic for _, channel, _ in make_reader(stream).iter_messages()}
    assert "/map" not in topics
    assert {"/path", "/scan", "/tf"} <= topics


def test_show_takes_the_beginning_of_an_id_too(
    root: Path, scenario: dict[str, Any], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    capfd.readouterr()
    picture = tmp_path / "a.png"
    arguments = ["show", scenario["scenario_id"][:10], "--root", str(root)]
    assert run([*arguments, "--out", str(picture), "--json"]) == 0
    (facts,) = json.loads(capfd.readouterr().out)
    assert facts["scenario_id"] == scenario["scenario_id"]
    assert picture.is_file()
