import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import typer

from flows.command_line import run
from flows.log_commands import select_rows
from storage.table_reader import open_table
from tests.flows.filled_store import fill_store


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("filled")
    fill_store(folder / "store", folder / "inbox")
    return folder / "store"


def answer(capfd: pytest.CaptureFixture[str], root: Path, *arguments: str) -> Any:
    capfd.readouterr()
    assert run([*arguments, "--root", str(root), "--json"]) == 0
    return json.loads(capfd.readouterr().out)


def test_scenarios_are_picked_by_a_condition(root: Path, capfd: pytest.CaptureFixture[str]) -> None:
    rows = answer(capfd, root, "scenarios", "--where", "negative_velocity_count > 50")
    table = open_table(root, "scenarios")

    expected = table[table["negative_velocity_count"] > 50]
    assert [row["scenario_id"] for row in rows] == list(expected["scenario_id"])
    assert rows[0]["is_challenging"] is False
    assert rows[0]["negative_velocity_count"] == expected["negative_velocity_count"].iloc[0]
    assert len(answer(capfd, root, "scenarios", "--limit", "1")) == 1


def test_a_condition_on_no_column_is_misuse(root: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["scenarios", "--where", "speed > 1", "--root", str(root)]) == 2

    line = capfd.readouterr().err
    assert line.count("\n") == 1
    assert "no such column: speed" in line
    assert "negative_velocity_count" in line


def test_an_unknown_count_is_null_and_never_zero() -> None:
    table = pd.DataFrame(
        {
            "scenario_id": ["a", "b"],
            "negative_velocity_count": pd.array([None, 0], dtype="Int64"),
            "is_challenging": [False, True],
        }
    )

    assert select_rows(table, where="negative_velocity_count IS NULL", limit=None) == [
        {"scenario_id": "a", "negative_velocity_count": None, "is_challenging": False}
    ]
    assert len(select_rows(table, where="negative_velocity_count = 0", limit=None)) == 1
    with pytest.raises(typer.BadParameter):
        select_rows(table, where="1); DROP TABLE scenarios; --", limit=None)


@pytest.mark.parametrize("table", ["scenarios", "logs"])
def test_what_is_shown_is_drawn_and_its_facts_told(
    root: Path, table: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    column = f"{table[:-1]}_id"
    identity = str(open_table(root, table)[column].iloc[0])
    picture = tmp_path / "deeper" / "it.png"

    (facts,) = answer(capfd, root, "show", identity, "--out", str(picture))

    assert facts[column] == identity
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert run(["show", "nothing", "--root", str(root)]) == 2


def test_a_scenario_is_explained_by_its_log_and_back(
    root: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scenario = open_table(root, "scenarios").iloc[0]

    of_scenario = answer(capfd, root, "explain", str(scenario["scenario_id"]))
    of_log = answer(capfd, root, "explain", str(scenario["log_id"]))

    links = {(row["relation"], row["kind"], row["id"]) for row in of_scenario}
    assert ("from", "log", scenario["log_id"]) in links
    links = {(row["relation"], row["kind"], row["id"]) for row in of_log}
    assert ("into", "scenario", scenario["scenario_id"]) in links
    assert run(["explain", "nothing", "--root", str(root)]) == 2


def test_refused_logs_are_listed_shown_and_tried_again(
    root: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (listed,) = answer(capfd, root, "quarantine", "list")
    shown = answer(capfd, root, "quarantine", "show", listed["log_id"][:10])
    (tried,) = answer(capfd, root, "quarantine", "retry", listed["log_id"])

    assert listed["name"] == "office/r07/torn.bag"
    assert listed["reason"] == "truncated"
    assert shown == listed
    assert (tried["status"], tried["reason"]) == ("quarantined", "truncated")
    assert tried["message"] == listed["message"]
