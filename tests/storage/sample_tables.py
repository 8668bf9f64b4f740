"""Rows for every table, and whole commits of them."""

from collections.abc import Callable
from datetime import date
from pathlib import Path

import numpy as np
import pyarrow as pa

from ses_core.recipes import ArtifactRef, Recipe
from storage.artifact_store import LocalArtifactStore
from storage.materialize import materialize
from storage.parquet_files import Column, write_table
from storage.stages import INGEST
from storage.table_log import TableLog
from storage.table_parts import artifact_parts
from storage.table_schemas import TABLES, table_schema

DAY = date(2026, 11, 22)
SITES = ("home", "office", "yard")


def sample_columns(table: str, *, tag: str = "a", day: date = DAY) -> dict[str, Column]:
    """Make three rows of a table, with nulls and NaN wherever they are allowed."""
    columns = {field.name: _values(field, tag) for field in table_schema(table)}
    if "batch_date" in columns:
        columns["batch_date"] = [day.isoformat()] * 3
    if "site" in columns:
        columns["site"] = list(SITES)
    return columns


def recipe_of(tag: str) -> Recipe:
    return Recipe(INGEST, {"tag": tag})


def build_of(
    tag: str, *, day: date = DAY, tables: tuple[str, ...] = TABLES
) -> Callable[[Path], None]:
    def build(folder: Path) -> None:
        for table in tables:
            write_table(folder / f"{table}.parquet", table, sample_columns(table, tag=tag, day=day))

    return build


def commit_sample(
    store: LocalArtifactStore,
    log: TableLog,
    tag: str,
    *,
    day: date = DAY,
    tables: tuple[str, ...] = TABLES,
) -> ArtifactRef:
    """Do what a night does for one log: find or build its rows, then commit them."""
    made = materialize(store, recipe_of(tag), build_of(tag, day=day, tables=tables))
    parts = artifact_parts(store, made.ref, name=tag, batch_date=day)
    log.commit(parts, message=f"take in {tag}")
    return made.ref


def _values(field: pa.Field, tag: str) -> Column:
    if pa.types.is_fixed_size_list(field.type):
        cells = np.zeros((3, 30, 30), dtype=np.bool_)
        cells[1, 0, 29] = True
        return cells
    if pa.types.is_list(field.type):
        return np.linspace(0.0, 4.0, 12, dtype=np.float32).reshape(3, 4)
    if field.name.endswith("_id"):
        return [f"{tag}-{number}" for number in range(3)]
    if field.type == pa.string():
        return ["one", "two", None] if field.nullable else ["one", "two", "three"]
    if field.type == pa.bool_():
        return [True, False, None] if field.nullable else [True, False, True]
    if field.type == pa.int64():
        return [0, 51, None] if field.nullable else [0, 51, 2**62]
    return np.array([0.1, np.nan, -2.5])
