"""`open_table`: a table as a DataFrame, filtered by date and site, cells as (30, 30) arrays."""

from collections.abc import Iterable, Sequence
from datetime import date
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

from ses_core.errors import ArtifactError
from ses_core.occupancy import ENVIRONMENT_CELLS
from storage.artifact_store import LocalArtifactStore
from storage.layout import Layout
from storage.object_files import FileDroppedError
from storage.parquet_files import read_arrow, to_pandas
from storage.table_log import TableLog
from storage.table_schemas import DATED_TABLES, table_schema

_CELL_COLUMNS = ("cells", "observed")


def open_table(
    root: Path,
    name: str,
    *,
    since: date | None = None,
    until: date | None = None,
    sites: Iterable[str] | None = None,
    columns: Sequence[str] | None = None,
) -> pd.DataFrame:
    """Read a table whose every byte is checked, once per call.

    Args:
        root: Root of the store.
        name: Name of the table.
        since: First batch date.
        until: Last batch date.
        sites: Sites; all of them by default.
        columns: Columns; all of them by default. `cells` and `observed` hold arrays (30, 30).

    Raises:
        ArtifactError: There is no store, or a part is missing or damaged.
        SchemaError: No table or column has this name.
        ValueError: The table does not say of which day or site its rows are.
    """
    table_schema(name)
    if not Layout(root).store_file.exists():
        raise ArtifactError(f"{root} holds no store, expected {Layout(root).store_file}")
    reader = _Reader(LocalArtifactStore(root))
    wanted = None if sites is None else frozenset(sites)
    rows = reader.rows(name, since, until, wanted, None if columns is None else list(columns))
    frame = to_pandas(rows)
    for column in _CELL_COLUMNS:
        if column in frame:
            frame[column] = _as_squares(rows[column])
    return frame


class _Reader:
    """One call's view of the store."""

    def __init__(self, store: LocalArtifactStore) -> None:
        self._store = store
        self._log = TableLog(store.layout)

    def rows(
        self,
        name: str,
        since: date | None,
        until: date | None,
        sites: frozenset[str] | None,
        columns: list[str] | None,
    ) -> pa.Table:
        """Read the parts of a table that the filters leave, row by row where needed."""
        schema = table_schema(name)
        keep = self._filters(name, schema, since, until, sites)
        needed = None if columns is None else list(dict.fromkeys([*columns, *keep]))
        tables = []
        for part in self._log.parts(name):
            if part.folder and not _is_within(part.folder, since, until):
                continue
            try:
                file = self._store.file(part.ref, part.file)
            except FileDroppedError:
                continue  # Older than the retention; the log is about to say so.
            rows = read_arrow(file, name, needed)
            for column, values in keep.items():
                rows = rows.filter(pc.is_in(rows[column], value_set=values))
            tables.append(rows)
        if not tables:
            empty = schema.empty_table()
            tables = [empty if needed is None else empty.select(needed)]
        joined = pa.concat_tables(tables)
        return joined if columns is None else joined.select(columns)

    def _filters(
        self,
        name: str,
        schema: pa.Schema,
        since: date | None,
        until: date | None,
        sites: frozenset[str] | None,
    ) -> dict[str, pa.Array]:
        """Give the values that the rows' columns must have, column by column."""
        filters_days = (since, until) != (None, None) and name not in DATED_TABLES
        if not filters_days and sites is None:
            return {}
        if name in ("logs", "scenarios"):
            rows = self.rows(name, None, None, None, ["batch_date", "site"])
            days = set(rows["batch_date"].to_pylist())
            keep = {"batch_date": [day for day in days if _is_within(day, since, until)]}
            if sites is not None:
                keep["site"] = list(sites)
            return {column: pa.array(values, pa.string()) for column, values in keep.items()}
        for column, parent in (("log_id", "logs"), ("scenario_id", "scenarios")):
            if column in schema.names:
                rows = self.rows(parent, since, until, sites, [column])
                return {column: rows[column].combine_chunks()}
        raise ValueError(f"table {name} cannot be filtered by date or site: its rows have neither")


def _is_within(day: str, since: date | None, until: date | None) -> bool:
    # ISO dates sort like the days they name.
    return (since is None or day >= since.isoformat()) and (
        until is None or day <= until.isoformat()
    )


def _as_squares(column: pa.ChunkedArray) -> pd.Series:
    flat = column.combine_chunks().flatten().to_numpy(zero_copy_only=False)
    return pd.Series(list(flat.reshape(-1, ENVIRONMENT_CELLS, ENVIRONMENT_CELLS)), dtype=object)
