"""Verified difficulties on disk: `difficulties.parquet`, and what a store knows of them already."""

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Final

import pandas as pd

from ses_core.evaluation.difficulty import VerifiedDifficulty, approach_heading
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationEnvironment
from storage.parquet_files import read_table, write_table
from storage.table_reader import open_table

DIFFICULTIES_FILE: Final = "difficulties.parquet"

_ENTRY_COLUMNS: Final = [
    "scenario_id",
    "start_x_m",
    "start_y_m",
    "start_yaw_rad",
    "goal_x_m",
    "goal_y_m",
]

_COLUMNS: Final = [column.name for column in fields(VerifiedDifficulty)]


def write_difficulties(
    directory: Path,
    rows: Sequence[VerifiedDifficulty],
    *,
    conditions: str,
    run_id: str | None = None,
) -> None:
    """Write rows into a folder.

    Args:
        directory: Where to.
        rows: One per environment.
        conditions: Digest of all that decides a row beside its environment.
        run_id: The night that asked; None in what several nights may share.

    Raises:
        ArtifactError: The disk is full or failing.
    """
    columns = {name: [getattr(row, name) for row in rows] for name in _COLUMNS}
    columns |= {"conditions": [conditions] * len(rows), "run_id": [run_id] * len(rows)}
    write_table(directory / DIFFICULTIES_FILE, "difficulties", columns)


def read_difficulties(directory: Path) -> list[VerifiedDifficulty]:
    """Read the rows of a folder in their order.

    Raises:
        ArtifactError: The file is missing or damaged.
        SchemaError: It is no table of difficulties.
    """
    return _rows(read_table(directory / DIFFICULTIES_FILE, "difficulties", columns=_COLUMNS))


def read_conditions(directory: Path) -> str:
    """Give under which conditions the rows of a folder were driven; empty without a row."""
    found = read_table(directory / DIFFICULTIES_FILE, "difficulties", columns=["conditions"])
    return str(found["conditions"].iloc[0]) if len(found) else ""


def known_difficulties(root: Path, conditions: str) -> dict[str, VerifiedDifficulty]:
    """Give what earlier nights found under the same conditions, by environment.

    Raises:
        ArtifactError: A part of the table is damaged.
    """
    table = open_table(root, "difficulties", columns=[*_COLUMNS, "conditions"])
    found = table[table["conditions"] == conditions]
    return {row.environment_id: row for row in _rows(found)}


def logged_headings(root: Path, environments: Sequence[NavigationEnvironment]) -> dict[str, float]:
    """Give how recorded environments were entered, by their ids [rad in the scenario's frame].

    Raises:
        ArtifactError: A part of the table of scenarios is damaged.
    """
    table = open_table(root, "scenarios", columns=_ENTRY_COLUMNS)
    entries = table[table["scenario_id"].isin([one.scenario_id for one in environments])]
    headings = {
        name: approach_heading(Pose2D(x, y, yaw), (goal_x, goal_y))
        for name, x, y, yaw, goal_x, goal_y in zip(
            *(entries[column].tolist() for column in _ENTRY_COLUMNS), strict=True
        )
    }
    return {
        one.environment_id: headings[one.scenario_id]
        for one in environments
        if one.scenario_id in headings
    }


def _rows(table: pd.DataFrame) -> list[VerifiedDifficulty]:
    columns = [table[name].tolist() for name in _COLUMNS]
    return [
        VerifiedDifficulty(**dict(zip(_COLUMNS, row, strict=True)))
        for row in zip(*columns, strict=True)
    ]
