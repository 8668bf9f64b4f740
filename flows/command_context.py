"""What every command gets and how it answers: root, settings; text or JSON on stdout."""

import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import typer

from ses_core.recipes import JsonValue

if TYPE_CHECKING:
    from ses_core.settings import Settings
    from storage.layout import Layout

Row = Mapping[str, JsonValue]


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandContext:
    """The global options, and where answers go."""

    root: Path
    settings_file: Path | None
    is_json: bool
    output: TextIO

    def settings(self, overrides: Mapping[str, JsonValue] | None = None) -> "Settings":
        """Read the settings file, if any, and put options over it.

        Args:
            overrides: Values by dotted name, as `filter.threshold`.

        Raises:
            SettingsError: The file, or an option's value, cannot be used.
        """
        from storage.settings_file import parse_settings, read_settings

        settings = parse_settings({}, source="defaults")
        if self.settings_file is not None:
            settings = read_settings(self.settings_file)
        if not overrides:
            return settings
        tree = settings.model_dump(mode="json")
        for name, value in overrides.items():
            *groups, last = name.split(".")
            group = tree
            for part in groups:
                group = group[part]
            group[last] = value
        return parse_settings(tree, source="command line")

    def existing_store(self) -> "Layout":
        """Open the store that commands read which only look.

        Raises:
            typer.BadParameter: There is none.
        """
        from storage.layout import Layout, open_layout

        if not Layout(self.root).store_file.is_file():
            raise typer.BadParameter(
                f"found no store at {self.root}, expected one that `ses nightly` made",
                param_hint="--root",
            )
        return open_layout(self.root)

    def answer(self, value: JsonValue, text: Callable[[], str]) -> None:
        """Write the command's result: `value` as JSON, or the text for people."""
        if self.is_json:
            self.output.write(json.dumps(value) + "\n")
        elif written := text():
            self.output.write(written + "\n")
        self.output.flush()

    def answer_rows(self, rows: Sequence[Row], *, empty: str) -> None:
        """Write rows: a JSON list, or an aligned table; `empty` says that there are none."""
        listed = [dict(row) for row in rows]
        self.answer(listed, lambda: aligned(rows) if rows else empty)


def given(options: Mapping[str, JsonValue]) -> dict[str, JsonValue]:
    """Drop the options that were not given."""
    return {name: value for name, value in options.items() if value is not None}


def answer_facts(command: CommandContext, facts: Mapping[str, JsonValue]) -> None:
    """Answer with one thing's facts: a JSON object, or a line for each."""
    lines: list[Row] = [{"what": name, "value": value} for name, value in facts.items()]
    command.answer(dict(facts), lambda: aligned(lines))


def command_context(context: typer.Context) -> CommandContext:
    """Give what the global options said."""
    found = context.find_root().obj
    if not isinstance(found, CommandContext):
        raise TypeError(f"found {type(found).__name__} as the context, expected CommandContext")
    return found


@contextmanager
def answers_only_on_stdout(*, is_json: bool) -> Iterator[TextIO]:
    """Give the stream for the answer; with JSON, whatever else is printed goes to stderr.

    Compiled libraries print on the descriptor itself (PyBullet greets), so it is that which moves.
    """
    if not is_json:
        yield sys.stdout
        return
    sys.stdout.flush()
    saved = os.dup(1)
    os.dup2(2, 1)
    try:
        with os.fdopen(os.dup(saved), "w") as output:
            yield output
    finally:
        sys.stdout.flush()
        os.dup2(saved, 1)
        os.close(saved)


def aligned(rows: Sequence[Row]) -> str:
    """Lay rows out in columns, numbers to the right."""
    columns = list(rows[0])
    cells = [[_cell(row.get(column)) for column in columns] for row in rows]
    widths = [max(len(line[i]) for line in [columns, *cells]) for i in range(len(columns))]
    numeric = [all(_is_number(row.get(column)) for row in rows) for column in columns]

    def line(texts: Sequence[str]) -> str:
        padded = (
            text.rjust(width) if right else text.ljust(width)
            for text, width, right in zip(texts, widths, numeric, strict=True)
        )
        return "  ".join(padded).rstrip()

    return "\n".join([line(columns), *map(line, cells)])


def _cell(value: JsonValue) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"
    if isinstance(value, Mapping | list | tuple):
        return json.dumps(value)
    return str(value)


def _is_number(value: JsonValue) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))
