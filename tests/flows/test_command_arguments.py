from collections.abc import Sequence
from pathlib import Path

import pytest
import typer
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flows.command_arguments import (
    existing_directory,
    existing_path,
    hoist_global_options,
    misuse,
    sentence,
)
from ses_core.errors import SettingsError


@pytest.mark.parametrize(
    ("given_arguments", "expected"),
    [
        (["status", "--root", "a"], ["--root", "a", "status"]),
        (["status", "--json", "--root=a"], ["--json", "--root=a", "status"]),
        (["--root", "a", "status"], ["--root", "a", "status"]),
        (
            ["nightly", "--inbox", "x", "--settings", "s"],
            ["--settings", "s", "nightly", "--inbox", "x"],
        ),
        (["scenarios", "--", "--json"], ["scenarios", "--", "--json"]),
        (["show", "--rooted"], ["show", "--rooted"]),
    ],
)
def test_global_options_move_in_front_of_the_command(
    given_arguments: Sequence[str], expected: Sequence[str]
) -> None:
    assert hoist_global_options(given_arguments) == expected


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.sampled_from(["status", "--json", "--root=a", "-x", "--limit", "3"])))
def test_hoisting_loses_nothing_and_keeps_the_order_of_the_rest(arguments: list[str]) -> None:
    hoisted = hoist_global_options(arguments)

    assert sorted(hoisted) == sorted(arguments)
    rest = [x for x in arguments if x not in {"--json", "--root=a"}]
    assert [x for x in hoisted if x not in {"--json", "--root=a"}] == rest


def test_a_global_option_without_its_value_is_misuse() -> None:
    with pytest.raises(typer.BadParameter, match="found no value"):
        hoist_global_options(["status", "--root"])


def test_misuse_names_the_option_and_keeps_the_words() -> None:
    with pytest.raises(typer.BadParameter, match="too long") as caught, misuse("--part"):
        raise SettingsError("too\nlong")

    assert caught.value.param_hint == "--part"
    assert caught.value.message == "too long"


def test_a_folder_that_is_a_file_is_misuse(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()

    assert existing_directory(tmp_path, "--inbox") == tmp_path
    assert existing_path(file, "PATH") == file
    with pytest.raises(typer.BadParameter, match="found a file"):
        existing_directory(file, "--inbox")
    with pytest.raises(typer.BadParameter, match="found nothing"):
        existing_directory(tmp_path / "none", "--inbox")
    with pytest.raises(typer.BadParameter, match="found nothing"):
        existing_path(tmp_path / "none", "PATH")


def test_an_error_of_several_lines_becomes_one() -> None:
    assert sentence(ValueError("a\n  b")) == "a b"
