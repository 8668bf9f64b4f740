"""Synthesized environments on disk: one `environments.parquet` of the contract's columns."""

from pathlib import Path

import numpy as np

from ses_core.extraction.difficulty import measure_difficulty
from ses_core.navigation import NavigationDomain
from ses_core.occupancy import ENVIRONMENT_RESOLUTION_M
from ses_core.robot_profile import RobotProfile
from storage.parquet_files import read_table, write_table
from storage.scenario_tables import environments_of

ENVIRONMENTS_FILE = "environments.parquet"

SYNTHESIS_FILE = "synthesis.json"
"""Beside synthesized ones: how they came to be."""

_MEASURES = {
    "closest_obstacle_m": "closest_obstacle",
    "visibility_m": "visibility",
    "dispersion": "dispersion",
    "characteristic_dimension_m": "characteristic_dimension",
    "tortuosity": "tortuosity",
}


def write_environments(
    directory: Path, domain: NavigationDomain, *, target: RobotProfile, run_id: str | None = None
) -> Path:
    """Write environments with their difficulty for the target robot; gives the file's path.

    Raises:
        ArtifactError: The disk is full or failing.
    """
    environments = domain.environments
    measured = [
        measure_difficulty(environment.cells, radius=target.inscribed_radius_m)
        for environment in environments
    ]
    path = directory / ENVIRONMENTS_FILE
    write_table(
        path,
        "environments",
        {
            "environment_id": [environment.environment_id for environment in environments],
            "scenario_id": [environment.scenario_id for environment in environments],
            "origin": [environment.origin for environment in environments],
            "cells": [item.cells for item in environments],
            "observed": [item.observed for item in environments],
            "resolution_m": np.full(len(environments), ENVIRONMENT_RESOLUTION_M),
            "observed_fraction": [float(item.observed.mean()) for item in environments],
            "is_traversable": [measures is not None for measures in measured],
            "run_id": [run_id] * len(environments),
            **{
                column: [
                    None if measures is None else float(getattr(measures, name))
                    for measures in measured
                ]
                for column, name in _MEASURES.items()
            },
        },
    )
    return path


def read_environments(directory: Path) -> NavigationDomain:
    """Read the environments of a folder in their order.

    Raises:
        ArtifactError: The file is missing or damaged.
        SchemaError: It is no table of environments.
    """
    rows = read_table(directory / ENVIRONMENTS_FILE, "environments")
    return NavigationDomain(tuple(environments_of(rows)))
