"""What an id on the command line names: the whole of it, or a beginning that nothing else has."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import typer

from ses_core.recipes import JsonValue

if TYPE_CHECKING:
    import pandas as pd

    from storage.layout import Layout

TABLES: Mapping[str, str] = {
    "scenarios": "scenario_id",
    "environments": "environment_id",
    "logs": "log_id",
}
"""Tables that are looked through, and the column that names their rows."""

_LISTED = 3


def find_row(
    layout: "Layout",
    identity: str,
    *,
    expected: str = "the id of a scenario, an environment or a log",
) -> tuple[str, dict[str, JsonValue]]:
    """Find the table and the row that an id names.

    Args:
        layout: The store to look through.
        identity: The id, or its beginning.
        expected: What whoever asks can use, for the refusal of an id that nothing has.

    Raises:
        typer.BadParameter: Nothing, or more than one thing, has this id.
    """
    from storage.table_reader import open_table

    known = {
        str(found): table
        for table, column in TABLES.items()
        for found in open_table(layout.root, table, columns=[column])[column]
    }
    whole = pick_id(identity, list(known), expected=expected)
    table = known[whole]
    rows = open_table(layout.root, table)
    return table, _plain(rows[rows[TABLES[table]] == whole].iloc[0])


def pick_id(identity: str, known: Sequence[str], *, expected: str) -> str:
    """Give the id that is this one, or the only one that begins with it.

    Raises:
        typer.BadParameter: There is none, or more than one.
    """
    if identity in known:
        return identity
    fitting = sorted({one for one in known if identity and one.startswith(identity)})
    if len(fitting) == 1:
        return fitting[0]
    if not fitting:
        raise typer.BadParameter(
            f"found {identity!r}, expected {expected}, or its beginning", param_hint="ID"
        )
    shown = ", ".join(fitting[:_LISTED]) + (", ..." if len(fitting) > _LISTED else "")
    raise typer.BadParameter(
        f"found {identity!r}, which {len(fitting)} ids begin with ({shown}), expected more of one",
        param_hint="ID",
    )


def _plain(row: "pd.Series") -> dict[str, JsonValue]:
    """Give a row as JSON values; what is missing is null."""
    import pandas as pd

    plain: dict[str, JsonValue] = {}
    for name, value in row.items():
        if hasattr(value, "tolist"):
            value = value.tolist()
        plain[str(name)] = value if isinstance(value, list) or not pd.isna(value) else None
    return plain
