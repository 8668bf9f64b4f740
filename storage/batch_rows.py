"""The rows that a selection is made from, one file per batch: a night reads days, not logs.

The batch under way is read log by log. An older one no longer changes from night to night, so
its rows are put together once and found ever after; a batch that does change (a log of it was
extracted anew) is another set of inputs, and put together again.

The cells of places are by far the most of it, and are read only of those that were chosen.
"""

from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

from ses_core.recipes import Recipe
from storage.artifact_store import LocalArtifactStore
from storage.log_catalogue import catalogue
from storage.materialize import materialize
from storage.parquet_files import merge_tables, read_arrow, to_pandas
from storage.stages import BATCH
from storage.table_log import TableLog
from storage.table_parts import TablePart
from storage.table_schemas import table_schema

TABLES = ("logs", "scenarios", "environments")
CELL_COLUMNS = ("cells", "observed")


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchRows:
    """Rows of all logs of a store; synthesized environments are not among them.

    Attributes:
        environments: All columns but the cells.
        environment_files: Where these rows are whole.
    """

    logs: pd.DataFrame
    scenarios: pd.DataFrame
    environments: pd.DataFrame
    environment_files: tuple[Path, ...]

    def whole_environments(self, identities: Collection[str]) -> pd.DataFrame:
        """Read the rows of some environments with their cells, in the order of all rows.

        Raises:
            ArtifactError: A file is missing or damaged.
        """
        wanted = pa.array(sorted(set(identities)), pa.string())
        chosen = [table_schema("environments").empty_table()]
        for file in self.environment_files if len(wanted) else ():
            found = read_arrow(file, "environments", ["environment_id"])["environment_id"]
            if pc.any(pc.is_in(found, value_set=wanted)).as_py():
                rows = read_arrow(file, "environments")
                chosen.append(rows.filter(pc.is_in(rows["environment_id"], value_set=wanted)))
        return to_pandas(pa.concat_tables(chosen))


def read_batch_rows(store: LocalArtifactStore, tables: TableLog, *, newest: date) -> BatchRows:
    """Read the rows of every log, batch by batch.

    Args:
        store: Where they are kept.
        tables: Where they are listed.
        newest: The batch under way.

    Raises:
        ArtifactError: A part is missing or damaged.
    """
    day_of = {entry.log_id: entry.batch_date for entry in catalogue(tables)}
    batches: defaultdict[date, list[TablePart]] = defaultdict(list)
    for part in (part for table in TABLES for part in tables.parts(table)):
        if part.name in day_of:
            batches[day_of[part.name]].append(part)
    files: dict[str, list[Path]] = {table: [] for table in TABLES}
    for day, parts in sorted(batches.items()):
        if day < newest:
            folder = _merged(store, day, parts)
            for table in TABLES:
                files[table].append(folder / f"{table}.parquet")
        else:
            for part in parts:
                files[part.table].append(store.file(part.ref, part.file))
    return BatchRows(
        logs=_read_all("logs", files["logs"]),
        scenarios=_read_all("scenarios", files["scenarios"]),
        environments=_read_all("environments", files["environments"]),
        environment_files=tuple(files["environments"]),
    )


def _read_all(table: str, files: Sequence[Path]) -> pd.DataFrame:
    """Read files of a table as one frame, without cells."""
    names = [name for name in table_schema(table).names if name not in CELL_COLUMNS]
    empty = table_schema(table).empty_table().select(names)
    return to_pandas(pa.concat_tables([empty, *(read_arrow(file, table, names) for file in files)]))


def _merged(store: LocalArtifactStore, day: date, parts: Sequence[TablePart]) -> Path:
    """Give the folder with one file per table of an older batch."""

    def build(directory: Path) -> None:
        for table in TABLES:
            sources = [store.file(part.ref, part.file) for part in parts if part.table == table]
            merge_tables(directory / f"{table}.parquet", table, sources)

    inputs = frozenset(part.ref for part in parts)
    recipe = Recipe(BATCH, {"batch_date": day.isoformat()}, input_set=inputs)
    return store.path(materialize(store, recipe, build).ref)
