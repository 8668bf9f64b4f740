"""`ses scorecard`: rows as JSON and as a table on disk, and what it says of wrong input."""

import json
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path

import pytest
from PIL import Image

from flows.command_line import run
from ses_core.arrays import BoolArray
from ses_core.robot_profile import JACKAL
from storage.environment_files import ENVIRONMENTS_FILE, write_environments
from storage.scorecard_files import raw_traversable_share, read_scorecard, row_record
from tests.ses_core.scorecard.samples import pillars, score
from tests.ses_core.synthesis.places import domain_of

SETTINGS = "[scorecard]\nhalvings = 4\npermutations = 19\n[simulation]\ntime_limit_s = 6.0\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Real and synthesized environments, a damaged file, and settings."""
    made = tmp_path_factory.mktemp("scored")
    write(made / "real", pillars(24, seed=0))
    write(made / "synthesized", pillars(12, seed=1))
    (made / "nothing").mkdir()
    (made / "damaged").mkdir()
    (made / "damaged" / ENVIRONMENTS_FILE).write_bytes(b"PAR1 no more")
    (made / "ses.toml").write_text(SETTINGS, encoding="utf-8")
    return made


def write(directory: Path, cells: BoolArray) -> None:
    directory.mkdir()
    write_environments(directory, domain_of(cells), target=JACKAL)


def command(folder: Path, real: str, synthesized: str, *options: str) -> list[str]:
    return [
        "scorecard",
        "--real",
        str(folder / real),
        "--synthesized",
        str(folder / synthesized),
        "--root",
        str(folder / "store"),
        "--settings",
        str(folder / "ses.toml"),
        *options,
    ]


def test_rows_are_answered_and_written_with_a_picture(folder: Path, tmp_path: Path) -> None:
    options = ("--driven", "3", "--out", str(tmp_path / "out"), "--json")
    # A process of its own: Prefect keeps the address of the first server that it talked to.
    program = [sys.executable, "-m", "flows.command_line"]
    done = subprocess.run(
        [*program, *command(folder, "real", "synthesized", *options)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout)
    assert rows == [row_record(row) for row in read_scorecard(tmp_path / "out")]
    by_metric = {row["metric"]: row for row in rows}
    assert by_metric["traversable, shipped"]["value"] == 1.0
    assert by_metric["mean time"]["n_synthesized"] == 3
    assert by_metric["mean time"]["n_real"] == 6
    assert by_metric["coverage"]["halves"] == "by environment (24)"
    page = (tmp_path / "out" / "scorecard.html").read_text(encoding="utf-8")
    assert "Do these environments stand for those?" in page
    assert page.count('<tr class="group">') == 5
    assert Image.open(tmp_path / "out" / "scorecard.png").size[0] > 1000


def test_what_was_synthesized_brings_the_share_of_all_draws(folder: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [
            *(sys.executable, "-m", "flows.command_line", "synthesize", "--json"),
            *("--method", "rs", "--count", "6", "--from", str(folder / "real")),
            *("--root", str(tmp_path / "store"), "--out", str(tmp_path / "made")),
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert answer["environments"] == 6
    assert raw_traversable_share(tmp_path / "made") == 1.0 - answer["rejected_share"]


def test_people_read_one_line_for_each_row(
    folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = score(pillars(12, seed=0), pillars(3, seed=1)).rows
    monkeypatch.setattr("flows.scorecard_commands.embedded_server", nullcontext)
    monkeypatch.setattr("flows.environment_scorecard.scorecard", lambda **_: rows)
    assert run(command(folder, "real", "synthesized")) == 0
    lines = capfd.readouterr().out.splitlines()
    assert lines[0].split()[:2] == ["metric", "value"]
    assert len(lines) == 1 + len(rows)
    assert sum("too few: " in line for line in lines) == sum(
        "too few: " in row.note for row in rows
    )


@pytest.mark.parametrize(
    ("real", "synthesized", "options", "said"),
    [
        ("absent", "synthesized", (), "--real: found nothing at "),
        ("real", "ses.toml", (), "--synthesized: found a file at "),
        ("nothing", "synthesized", (), "--real: "),
        ("real", "damaged", (), "--synthesized: "),
        ("real", "synthesized", ("--policy", "nobody"), "--policy: found no policy 'nobody'"),
        ("real", "synthesized", ("--driven", "-1"), "scorecard.driven"),
        ("real", "synthesized", ("--training", "{folder}/real"), "--training: found 24 env"),
    ],
)
def test_misuse_is_said_in_one_line(
    folder: Path,
    capfd: pytest.CaptureFixture[str],
    real: str,
    synthesized: str,
    options: tuple[str, ...],
    said: str,
) -> None:
    given = [option.format(folder=folder) for option in options]
    assert run(command(folder, real, synthesized, *given)) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert said in line
