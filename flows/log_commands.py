"""`ses scenarios` and `ses show`: what is in the logs; `ses quarantine`: what was refused."""

import sqlite3
from typing import TYPE_CHECKING, Annotated

import typer

from flows.command_context import command_context
from ses_core.recipes import JsonValue

if TYPE_CHECKING:
    import pandas as pd

app = typer.Typer()

SHOWN_COLUMNS = (
    "scenario_id",
    "site",
    "robot",
    "batch_date",
    "kind",
    "duration_s",
    "arc_length_m",
    "negative_velocity_count",
    "not_forward_count",
    "is_challenging",
)
"""What fits a terminal; `--json` has all columns."""


@app.command(epilog="Example: ses scenarios --where 'negative_velocity_count > 50' --limit 10")
def scenarios(
    context: typer.Context,
    where: Annotated[
        str | None, typer.Option(metavar="SQL", help="Condition on the table's columns (SQLite).")
    ] = None,
    limit: Annotated[int | None, typer.Option(metavar="N", min=0, help="Rows at most.")] = None,
) -> None:
    """List scenarios."""
    from storage.table_reader import open_table

    command = command_context(context)
    table = open_table(command.existing_store().root, "scenarios")
    rows = select_rows(table, where=where, limit=limit)
    if not command.is_json:
        rows = [{column: row[column] for column in SHOWN_COLUMNS} for row in rows]
    command.answer_rows(rows, empty="no scenario")


def select_rows(
    table: "pd.DataFrame", *, where: str | None, limit: int | None
) -> list[dict[str, JsonValue]]:
    """Give the rows of a table that an SQL condition picks.

    Raises:
        typer.BadParameter: The condition is no SQL, or names a column that is not there.
    """
    condition = f" WHERE ({where})" if where else ""
    names = [str(name) for name in table.columns]
    columns = ", ".join(f'"{name}"' for name in names)
    missing = table.isna()
    values = table.astype(object).mask(missing, None)
    with sqlite3.connect(":memory:") as database:
        database.execute(f"CREATE TABLE scenarios ({columns})")
        database.executemany(
            f"INSERT INTO scenarios VALUES ({', '.join('?' * len(names))})",
            values.itertuples(index=False),
        )
        try:
            found = database.execute(
                f"SELECT * FROM scenarios{condition} LIMIT ?", (-1 if limit is None else limit,)
            ).fetchall()
        except sqlite3.Error as error:
            raise typer.BadParameter(
                f"found {where!r} ({error}), expected an SQL condition on {', '.join(names)}",
                param_hint="--where",
            ) from error
    truths = {name for name in names if str(table[name].dtype) in {"bool", "boolean"}}
    return [
        {
            name: bool(value) if name in truths and value is not None else value
            for name, value in zip(names, row, strict=True)
        }
        for row in found
    ]
