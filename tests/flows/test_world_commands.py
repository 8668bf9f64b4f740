"""`ses worlds import` and `show`: what they answer, draw, refuse and say of misuse."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flows.command_line import run
from storage.world_sets import read_worlds

PLAN = '{"verts": [[0, 0], [12, 0], [12, 4], [0, 4]]}'


@pytest.fixture
def maps(tmp_path: Path) -> Path:
    """A folder of a plan, a bad world and a file that is no map."""
    folder = tmp_path / "maps"
    folder.mkdir()
    (folder / "plan.json").write_text(PLAN)
    (folder / "bad.world").write_text("<sdf>")
    (folder / "notes.txt").write_text("about")
    return folder


def test_import_takes_what_it_can_and_says_what_it_refused(
    maps: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["worlds", "import", str(maps), "--out", str(tmp_path / "set"), "--json"]) == 0
    captured = capfd.readouterr()
    answer = json.loads(captured.out)
    assert [world["name"] for world in answer["worlds"]] == ["plan"]
    assert answer["passed_over"] == 1
    assert [line for line in captured.err.splitlines() if line.startswith("refused: ")] == [
        f"refused: {line}" for line in answer["refused"]
    ]
    assert "bad.world is no XML" in answer["refused"][0]
    (world,) = read_worlds([tmp_path / "set"])
    assert world.world_id == answer["worlds"][0]["world_id"]


def test_show_draws_the_pairs_that_an_evaluation_would_draw(maps: Path, tmp_path: Path) -> None:
    plan, goal = str(maps / "plan.json"), (0xD5, 0x5E, 0x00)
    for pairs, is_drawn in (("0", False), ("3", True)):
        sheet = tmp_path / f"{pairs}.png"
        assert run(["worlds", "show", plan, "--pairs", pairs, "--out", str(sheet)]) == 0
        with Image.open(io.BytesIO(sheet.read_bytes())) as image:
            pixels = np.asarray(image.convert("RGB"))
        assert np.all(pixels == goal, axis=-1).any() == is_drawn


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("--resolution 0", "--resolution: resolution is 0 m per cell, expected 0.001 to 10"),
        ("--slice-from 1", "--slice-from: slice from 1 to 0.5 m above the floor, expected two"),
        ("--up w", "--up: "),
    ],
)
def test_misuse_is_said_in_one_line(
    maps: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], options: str, said: str
) -> None:
    command = ["worlds", "import", str(maps / "plan.json"), "--out", str(tmp_path / "set")]
    assert run([*command, *options.split()]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert said in line
    assert not (tmp_path / "set").exists()


def test_a_named_file_that_is_bad_is_misuse(
    maps: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    bad = str(maps / "bad.world")
    assert run(["worlds", "import", bad, "--out", str(tmp_path / "set")]) == 2
    assert "PATH: " in (line := capfd.readouterr().err)
    assert "is no XML" in line
