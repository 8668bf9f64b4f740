import json
import re
import subprocess
import sys
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import get_args

import pytest
import typer.main
from typer.core import TyperCommand, TyperGroup

from flows.command_line import app, run
from ses_core.synthesis_settings import SynthesizerSettings
from storage.batch_manifest import RunRecord, record_run
from storage.layout import open_layout


@pytest.fixture
def store(tmp_path: Path) -> Path:
    root = tmp_path / "store"
    run_record = RunRecord(
        run_id="2026-11-22-0a1b2c3d",
        started_stamp_ns=1,
        seconds=2.0,
        logs=(),
        stages=(),
        decision="reported",
        champion="",
        summary={},
    )
    record_run(open_layout(root), date(2026, 11, 22), run_record)
    return root


@pytest.mark.parametrize(
    ("line", "found", "expected"),
    [
        ("", "no command", "nightly, demo, ingest"),
        ("nihgtly", "unknown command 'nihgtly'", "nightly"),
        ("nightly", "no --inbox", "a value"),
        ("nightly --inbox /none", "nothing at /none", "a folder"),
        ("nightly --inbox / --synthesizer vae", "'vae'", "'medoids', 'identity', 'mirror'"),
        ("synthesize --out x --method vae", "'vae'", "'pca', 'pca-paper', 'rs', 'medoids'"),
        ("nightly --inbox / --environments many", "'many'", "a valid integer"),
        ("nightly --inbox / --date soon", "'soon'", "%Y-%m-%d"),
        ("nightly --inbox / --threshold 50 --challenging-share 0.2", "both", "one of them"),
        ("nightly --inbox / --challenging-share 1.5", "1.5", "less than or equal to 1"),
        ("nightly --inbox / --train-steps 0", "0", "greater than or equal to 1"),
        ("nightly --inbox / --deadline 0", "0.0", "hours > 0"),
        ("nightly --inbox / --refresh sleep", "'sleep'", "'ingest', 'extract'"),
        ("nightly --inbox / --heldout-worlds /none", "nothing at /none", "a file or folder"),
        ("status --bogus", "--bogus", "one of its options"),
        ("status --root", "no value", "a path"),
        ("status --root /none", "no store at /none", "ses nightly"),
        ("bench nothing", "'nothing'", "increment"),
        ("verify now", "'now'", "nothing more"),
        ("worlds", "no command", "import, show, generate"),
        ("worlds import /none --out x", "nothing at /none", "a file or folder"),
        (
            "deploy --worlds / --deployments 1 --out x --format bag --split-seconds 9",
            "format bag",
            "mcap or db3",
        ),
        (
            "deploy --worlds / --deployments 1 --out x --odometry-drift 9",
            "'9'",
            "less than or equal to 0.2",
        ),
        ("serve --cron hourly", "'hourly'", "five fields"),
        ("serve --timezone Berlin", "'Berlin'", "Europe/Berlin"),
        ("serve --host 0.0.0.0 --no-password", "0.0.0.0 without a password", "127.0.0.1"),
        ("--settings /none.toml nightly --inbox /", "/none.toml", "a TOML file"),
    ],
)
def test_misuse_is_one_line_with_what_was_found_and_expected(
    line: str,
    found: str,
    expected: str,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SES_ROOT", raising=False)

    assert run(line.split()) == 2

    written = capfd.readouterr()
    assert written.out == ""
    assert written.err.count("\n") == 1
    assert found in written.err
    assert expected in written.err


def _commands(group: TyperGroup, path: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    yield path
    for name, command in group.commands.items():
        if isinstance(command, TyperGroup):
            yield from _commands(command, (*path, name))
        else:
            assert isinstance(command, TyperCommand)
            yield (*path, name)


ROOT_GROUP = typer.main.get_command(app)
assert isinstance(ROOT_GROUP, TyperGroup)


@pytest.mark.parametrize("path", list(_commands(ROOT_GROUP, ())), ids=" ".join)
def test_help_of_every_command_has_an_example_of_it(
    path: tuple[str, ...], capfd: pytest.CaptureFixture[str]
) -> None:
    assert run([*path, "--help"]) == 0

    text = " ".join(capfd.readouterr().out.split())
    assert f"Example: {' '.join(('ses', *path))}" in text


@pytest.mark.parametrize("command", ["synthesize", "nightly"])
def test_help_lists_every_synthesizer_there_are_settings_for(
    command: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert run([command, "--help"]) == 0
    kinds = get_args(get_args(SynthesizerSettings)[0])
    methods = {kind.model_fields["method"].default for kind in kinds}
    listed = re.findall(r"<(gan\|[^>]*)>", capfd.readouterr().out)
    assert [set(names.split("|")) for names in listed] == [methods]


def test_options_are_accepted_before_and_after_the_command(
    store: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["--json", "--root", str(store), "status"]) == 0
    before = json.loads(capfd.readouterr().out)
    assert run(["status", f"--root={store}", "--json"]) == 0
    after = json.loads(capfd.readouterr().out)

    before.pop("free_mib"), after.pop("free_mib")
    assert before == after
    assert before["last_run"] == "2026-11-22-0a1b2c3d"


def test_the_root_may_come_from_the_environment(
    store: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SES_ROOT", str(store))

    assert run(["status", "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["root"] == str(store)


def test_promotion_without_a_gate_is_refused_with_three(
    store: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["promote", "2026-11-22-0a1b2c3d", "--root", str(store), "--json"]) == 3
    written = capfd.readouterr()
    assert json.loads(written.out)["promoted"] is False
    assert "no gate" in written.err

    assert run(["promote", "2026-11-23-ffffffff", "--root", str(store)]) == 2


def test_rollback_without_a_champion_fails_in_one_line(
    store: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["rollback", "--root", str(store)]) == 1
    assert capfd.readouterr().err.count("\n") == 1


def test_a_damaged_store_makes_verify_fail_and_repair_says_what_it_did(
    store: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["verify", "--root", str(store), "--json"]) == 0
    (store / "tables" / "logs" / "stranger.parquet").write_bytes(b"PAR1")
    capfd.readouterr()

    assert run(["verify", "--root", str(store), "--json"]) == 1
    assert json.loads(capfd.readouterr().out)["foreign"] == 1


def test_garbage_collection_counts_what_it_took(
    store: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["gc", "--root", str(store), "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["objects"] == 0


def test_worlds_are_generated_listed_and_drawn(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    made, picture = tmp_path / "made", tmp_path / "deeper" / "sheet.png"
    generate = ["worlds", "generate", "barn", "--count", "2", "--seed", "3", "--out", str(made)]
    assert run([*generate, "--json"]) == 0
    generated = json.loads(capfd.readouterr().out)["worlds"]
    assert run(["worlds", "show", str(made), "--out", str(picture), "--json"]) == 0
    shown = json.loads(capfd.readouterr().out)["worlds"]

    assert [world["name"] for world in generated] == ["barn-3-0000", "barn-3-0001"]
    assert shown == generated
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_an_answer_in_json_is_all_that_is_on_stdout(tmp_path: Path) -> None:
    code = (
        "import os, sys, typer\n"
        "from flows.command_context import command_context\n"
        "from flows.command_line import app, run\n"
        "@app.command()\n"
        "def noisy(context: typer.Context) -> None:\n"
        "    print('python talks'); os.system('echo a library talks')\n"
        "    command_context(context).answer({'a': 1}, lambda: 'text')\n"
        "sys.exit(run(['noisy', '--json']))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert done.stdout == '{"a": 1}\n'
    assert "python talks" in done.stderr
    assert "a library talks" in done.stderr


def test_light_commands_import_nothing_heavy(store: Path) -> None:
    code = (
        "import sys\n"
        "from flows.command_line import run\n"
        f"run(['--help']); run(['champion', '--root', {str(store)!r}])\n"
        "heavy = {'prefect', 'torch', 'pandas', 'pyarrow', 'sklearn', 'matplotlib', 'numba'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert done.stderr == "[]\n"
