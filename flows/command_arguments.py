"""Global options wherever they stand on the command line, and misuse in one line."""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import typer
from pydantic import ValidationError

# typer keeps the errors of its own parser to itself; the bound on typer's version keeps them here.
from typer._click.exceptions import MissingParameter, NoSuchOption, UsageError
from typer.core import TyperGroup

from ses_core.errors import SesError

VALUED_OPTIONS = ("--root", "--settings")
SWITCHES = ("--json",)


def hoist_global_options(arguments: Sequence[str]) -> list[str]:
    """Move the global options in front of the subcommand, where typer looks for them.

    What stands behind `--` is nobody's option and stays where it is.

    Raises:
        typer.BadParameter: The last one lacks its value.
    """
    hoisted: list[str] = []
    kept: list[str] = []
    remaining = list(arguments)
    while remaining:
        argument = remaining.pop(0)
        if argument == "--":
            kept += [argument, *remaining]
            break
        if argument in SWITCHES or argument.startswith(tuple(f"{x}=" for x in VALUED_OPTIONS)):
            hoisted.append(argument)
        elif argument in VALUED_OPTIONS:
            if not remaining:
                raise typer.BadParameter("found no value, expected a path", param_hint=argument)
            hoisted += [argument, remaining.pop(0)]
        else:
            kept.append(argument)
    return hoisted + kept


@contextmanager
def misuse(option: str) -> Iterator[None]:
    """Turn what goes wrong while an option's value is looked at into misuse of that option."""
    try:
        yield
    except (SesError, ValueError) as error:
        raise typer.BadParameter(sentence(error), param_hint=option) from error


def existing_directory(path: Path, option: str) -> Path:
    """Give the absolute form of a folder that must be there.

    Raises:
        typer.BadParameter: It is not.
    """
    if not path.is_dir():
        found = "a file" if path.exists() else "nothing"
        raise typer.BadParameter(f"found {found} at {path}, expected a folder", param_hint=option)
    return path.absolute()


def existing_path(path: Path, option: str) -> Path:
    """Give the absolute form of a file or folder that must be there.

    Raises:
        typer.BadParameter: It is not.
    """
    if not path.exists():
        raise typer.BadParameter(
            f"found nothing at {path}, expected a file or folder", param_hint=option
        )
    return path.absolute()


def describe_misuse(error: UsageError) -> str:
    """Say in one line which command was misused, what was found and what was expected."""
    command = error.ctx.command_path if error.ctx else "ses"
    return f"{command}: {_found_and_expected(error)} (see {command} --help)"


def sentence(error: BaseException) -> str:
    """Say in one line what an error says."""
    return " ".join(str(error).split())


def _found_and_expected(error: UsageError) -> str:
    if isinstance(error, NoSuchOption):
        near = sorted(error.possibilities or ())
        expected = " or ".join(near) if near else "one of its options"
        return f"found unknown option {error.option_name}, expected {expected}"
    if isinstance(error, MissingParameter):
        return f"found no {_parameter(error)}, expected a value for it"
    if isinstance(error, typer.BadParameter):
        return f"{_parameter(error)}: {_value_problem(error)}"
    if error.message == "Missing command.":
        return f"found no command, expected one of: {_commands(error)}"
    if unknown := re.match(r"No such command '(?P<name>.*?)'", error.message):
        return f"found unknown command {unknown['name']!r}, expected one of: {_commands(error)}"
    if extra := re.match(r"Got unexpected extra arguments? ?\(?s?\)? ?\((.*)\)", error.message):
        return f"found {extra[1]!r}, expected nothing more"
    return _lower_first(error.message)


def _commands(error: UsageError) -> str:
    command = error.ctx.command if error.ctx else None
    return ", ".join(command.commands) if isinstance(command, TyperGroup) else "its commands"


def _parameter(error: typer.BadParameter) -> str:
    if error.param_hint is not None:
        hint = error.param_hint
        return hint if isinstance(hint, str) else " / ".join(hint)
    if error.param is None:
        return "value"
    name = error.param.opts[0]
    return name if name.startswith("-") else name.upper()


def _value_problem(error: typer.BadParameter) -> str:
    """Word what the parser found like our own messages."""
    if not isinstance(error.__cause__, ValidationError):
        return _lower_first(error.message)
    first = error.__cause__.errors()[0]
    expected = first["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
    expected = re.sub(r"^.* is not (one of )", r"\1", expected)
    expected = re.sub(r"^.* does not match the formats? ", "a value like ", expected)
    expected = expected.partition(", unable to parse")[0].rstrip(".")
    return f"found {first['input']!r}, expected {expected}"


def _lower_first(message: str) -> str:
    text = " ".join(message.split()).rstrip(".")
    return text[:1].lower() + text[1:]
