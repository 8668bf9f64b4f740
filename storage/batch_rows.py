"""The rows that a selection is made from, one file per batch: a night reads days, not logs.

The batch under way is read log by log. An older one no longer changes from night to night, so
its rows are put together once and found ever after; a batch that does change (a log of it was
extracted anew) is another set of inputs, and put together again.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import pandas as pd

from ses_core.recipes import Recipe
from storage.artifact_store import LocalArtifactStore
from storage.log_catalogue import catalogue
from storage.materialize import materialize
from storage.parquet_files import merge_tables, read_table
from storage.stages import BATCH
from storage.table_log import TableLog
from storage.table_parts import TablePart

TABLES = ("logs", "scenarios", "environments")


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchRows:
    """Rows of all logs of a store; synthesized environments are not among them."""

    logs: pd.DataFrame
    scenarios: pd.DataFrame
    environments: pd.DataFrame


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
    frames = {
        table: pd.concat([read_table(file, table) for file in paths], ignore_index=True)
        for table, paths in files.items()
    }
    return BatchRows(**frames)


def _merged(store: LocalArtifactStore, day: date, parts: Sequence[TablePart]) -> Path:
    """Give the folder with one file per table of an older batch."""

    def build(directory: Path) -> None:
        for table in TABLES:
            sources = [store.file(part.ref, part.file) for part in parts if part.table == table]
            merge_tables(directory / f"{table}.parquet", table, sources)

    inputs = frozenset(part.ref for part in parts)
    recipe = Recipe(BATCH, {"batch_date": day.isoformat()}, input_set=inputs)
    return store.path(materialize(store, recipe, build).ref)
