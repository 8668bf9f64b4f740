"""What extraction writes for one log: its scenarios and their environments, as tables."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from ses_core.arrays import BoolArray
from ses_core.extraction.difficulty import is_challenging
from ses_core.extraction.extract import ExtractedScenario, PlaceQuality
from ses_core.navigation import NavigationEnvironment
from ses_core.occupancy import ENVIRONMENT_CELLS, ENVIRONMENT_RESOLUTION_M
from ses_core.settings import FilterSettings
from storage.parquet_files import read_table, write_table
from storage.table_schemas import table_schema

SCENARIOS_FILE = "scenarios.parquet"
ENVIRONMENTS_FILE = "environments.parquet"


def write_extracted(
    directory: Path,
    *,
    log_id: str,
    robot: str,
    site: str,
    batch_date: str,
    extracted: Sequence[ExtractedScenario],
    filter_settings: FilterSettings,
) -> None:
    """Write the scenarios and environments of one log into a folder.

    Args:
        directory: Where `scenarios.parquet` and `environments.parquet` go.
        log_id: Digest of the log.
        robot: Who drove.
        site: Where it drove.
        batch_date: ISO date of the batch that took the log in.
        extracted: What `ses_core.extraction.extract` gave.
        filter_settings: Decides `is_challenging`, by the threshold.
    """
    scenarios = [one.scenario for one in extracted]
    count = len(extracted)
    write_table(
        directory / SCENARIOS_FILE,
        "scenarios",
        {
            "scenario_id": [one.scenario_id for one in extracted],
            "log_id": [log_id] * count,
            "robot": [robot] * count,
            "site": [site] * count,
            "batch_date": [batch_date] * count,
            "kind": [scenario.kind for scenario in scenarios],
            "first_step": [scenario.first_step for scenario in scenarios],
            "last_step": [scenario.last_step for scenario in scenarios],
            "start_stamp_ns": [scenario.start_stamp_ns for scenario in scenarios],
            "duration_s": [scenario.duration_s for scenario in scenarios],
            "arc_length_m": [scenario.arc_length_m for scenario in scenarios],
            "start_x_m": [scenario.start.x for scenario in scenarios],
            "start_y_m": [scenario.start.y for scenario in scenarios],
            "start_yaw_rad": [scenario.start.yaw for scenario in scenarios],
            "goal_x_m": [scenario.goal[0] for scenario in scenarios],
            "goal_y_m": [scenario.goal[1] for scenario in scenarios],
            "negative_velocity_count": [scenario.negative_velocity_count for scenario in scenarios],
            "not_forward_count": [scenario.not_forward_count for scenario in scenarios],
            "reversing_s": [scenario.reversing_s for scenario in scenarios],
            "is_challenging": [is_challenging(scenario, filter_settings) for scenario in scenarios],
            "outcome": [scenario.outcome or None for scenario in scenarios],
            "environment_id": [
                one.environment.environment_id if one.environment else None for one in extracted
            ],
        },
    )
    places = [
        (one.environment, one.quality) for one in extracted if one.environment and one.quality
    ]
    write_table(directory / ENVIRONMENTS_FILE, "environments", _environment_columns(places))


def read_scenarios(paths: Iterable[Path]) -> pd.DataFrame:
    """Read `scenarios.parquet` files as one table, in the order given."""
    return _read_all(paths, "scenarios")


def read_environments(paths: Iterable[Path]) -> pd.DataFrame:
    """Read `environments.parquet` files as one table, in the order given."""
    return _read_all(paths, "environments")


def environments_of(rows: pd.DataFrame) -> list[NavigationEnvironment]:
    """Build the environments that rows of an `environments` table describe, in their order."""
    return [
        NavigationEnvironment(
            environment_id=str(row["environment_id"]),
            cells=_as_cells(row["cells"]),
            observed=_as_cells(row["observed"]),
            origin=str(row["origin"]),
            scenario_id=str(row["scenario_id"]),
        )
        for row in rows.to_dict("records")
    ]


def _as_cells(values: object) -> BoolArray:
    """Give 900 numbers, or (30, 30) of them, as environment cells."""
    return np.asarray(values).reshape(ENVIRONMENT_CELLS, ENVIRONMENT_CELLS).astype(np.bool_)


def _environment_columns(
    places: Sequence[tuple[NavigationEnvironment, PlaceQuality]],
) -> dict[str, Sequence[object]]:
    measures = [quality.difficulty for _, quality in places]
    columns: dict[str, Sequence[object]] = {
        "environment_id": [environment.environment_id for environment, _ in places],
        "scenario_id": [environment.scenario_id for environment, _ in places],
        "origin": [environment.origin for environment, _ in places],
        "cells": [environment.cells.astype(np.uint8) for environment, _ in places],
        "observed": [environment.observed.astype(np.uint8) for environment, _ in places],
        "resolution_m": [ENVIRONMENT_RESOLUTION_M] * len(places),
        "observed_fraction": [quality.observed_fraction for _, quality in places],
        "path_in_free_fraction": [quality.path_in_free_fraction for _, quality in places],
        "overridden_cells": [quality.overridden_cells for _, quality in places],
        "contradicted_fraction": [quality.contradicted_fraction for _, quality in places],
        "is_traversable": [quality.is_traversable for _, quality in places],
        "closest_obstacle_m": [one.closest_obstacle if one else None for one in measures],
        "visibility_m": [one.visibility if one else None for one in measures],
        "dispersion": [one.dispersion if one else None for one in measures],
        "characteristic_dimension_m": [
            one.characteristic_dimension if one else None for one in measures
        ],
        "tortuosity": [one.tortuosity if one else None for one in measures],
    }
    return columns


def _read_all(paths: Iterable[Path], table: str) -> pd.DataFrame:
    tables = [read_table(path, table) for path in paths]
    filled = [one for one in tables if len(one)]
    if not filled:
        return tables[0] if tables else table_schema(table).empty_table().to_pandas()
    return pd.concat(filled, ignore_index=True)
