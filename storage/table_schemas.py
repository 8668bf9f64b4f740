"""The columns of every table, as the contract promises them, and how they are checked.

Stamps are int64 ns UTC, dates are ISO text, identities are text. A column that may be null
is declared nullable; whole numbers and truth values among them open in pandas as `Int64`
and `boolean`, so that an unknown count is never a float and never 0.
"""

import json
from typing import Final

import pyarrow as pa

from ses_core.errors import SchemaError
from ses_core.occupancy import ENVIRONMENT_CELLS

SCHEMA_VERSION: Final = 1
"""Version of all tables together; a change of columns raises it (and needs a changelog line)."""

VERSION_KEY: Final = b"ses.schema_version"

DATED_TABLES: Final = frozenset({"trajectories", "scans"})
"""Tables kept in one folder per batch date; the others are flat."""

_TEXT = pa.string()
_WHOLE = pa.int64()
_REAL = pa.float64()
_TRUTH = pa.bool_()
_CELLS = pa.list_(pa.uint8(), ENVIRONMENT_CELLS * ENVIRONMENT_CELLS)
_READINGS = pa.list_(pa.float32())

_REQUIRED: Final[dict[str, dict[str, pa.DataType]]] = {
    "logs": {
        "log_id": _TEXT,
        "name": _TEXT,
        "robot": _TEXT,
        "site": _TEXT,
        "pose_source": _TEXT,
        "format": _TEXT,
        "batch_date": _TEXT,
        "start_stamp_ns": _WHOLE,
        "duration_s": _REAL,
        "path_length_m": _REAL,
        "steps": _WHOLE,
        "messages_in": _WHOLE,
        "messages_used": _WHOLE,
        # A JSON object: what was mended or passed over, with how often.
        "warnings": _TEXT,
    },
    "trajectories": {
        "log_id": _TEXT,
        "step": _WHOLE,
        "stamp_ns": _WHOLE,
        "x_m": _REAL,
        "y_m": _REAL,
        "yaw_rad": _REAL,
        "command_v_mps": _REAL,
        "command_w_radps": _REAL,
        "measured_v_mps": _REAL,
        "measured_w_radps": _REAL,
    },
    "scans": {
        "log_id": _TEXT,
        "scan": _WHOLE,
        "stamp_ns": _WHOLE,
        "step": _WHOLE,
        # Pose of the sensor, not of the body.
        "x_m": _REAL,
        "y_m": _REAL,
        "yaw_rad": _REAL,
        "angle_min_rad": _REAL,
        "angle_increment_rad": _REAL,
        "range_max_m": _REAL,
        "ranges_m": _READINGS,
    },
    "scenarios": {
        "scenario_id": _TEXT,
        "log_id": _TEXT,
        "robot": _TEXT,
        "site": _TEXT,
        "batch_date": _TEXT,
        "kind": _TEXT,
        "first_step": _WHOLE,
        "last_step": _WHOLE,
        "start_stamp_ns": _WHOLE,
        "duration_s": _REAL,
        "arc_length_m": _REAL,
        "start_x_m": _REAL,
        "start_y_m": _REAL,
        "start_yaw_rad": _REAL,
        "goal_x_m": _REAL,
        "goal_y_m": _REAL,
        "is_challenging": _TRUTH,
    },
    "environments": {
        "environment_id": _TEXT,
        # Empty for a synthesized environment.
        "scenario_id": _TEXT,
        "origin": _TEXT,
        "cells": _CELLS,
        "observed": _CELLS,
        "resolution_m": _REAL,
        "observed_fraction": _REAL,
        "is_traversable": _TRUTH,
    },
    "selections": {
        "run_id": _TEXT,
        "scenario_id": _TEXT,
        "rank": _WHOLE,
        "count_kind": _TEXT,
    },
    "episodes": {
        "episode_id": _TEXT,
        "run_id": _TEXT,
        "policy": _TEXT,
        "world_id": _TEXT,
        "pair": _WHOLE,
        "trial": _WHOLE,
        "seed": _WHOLE,
        "outcome": _TEXT,
        "time_s": _REAL,
        "path_length_m": _REAL,
        "optimal_time_s": _REAL,
        "barn_score": _REAL,
        "negative_velocity_count": _WHOLE,
        "not_forward_count": _WHOLE,
    },
    "difficulties": {
        "environment_id": _TEXT,
        "policy_id": _TEXT,
        "trials": _WHOLE,
        # Means over the trials.
        "negative_velocity_count": _REAL,
        "not_forward_count": _REAL,
        "success_rate": _REAL,
        "restricted_mean_time_s": _REAL,
        # Digest of all that decides a row beside its environment.
        "conditions": _TEXT,
    },
    "policies": {
        "policy_id": _TEXT,
        "run_id": _TEXT,
        "algorithm": _TEXT,
        "steps": _WHOLE,
        "seed": _WHOLE,
        "environments": _WHOLE,
        "created_stamp_ns": _WHOLE,
        "decision": _TEXT,
    },
    "scorecard": {
        "metric": _TEXT,
        "feature": _TEXT,
        "unit": _TEXT,
        "aim": _TEXT,
        "n_real": _WHOLE,
        "n_synthesized": _WHOLE,
        "halves": _TEXT,
        "note": _TEXT,
    },
}

_NULLABLE: Final[dict[str, dict[str, pa.DataType]]] = {
    "logs": {
        "profile": _TEXT,
        "velocity_source": _TEXT,
        "has_clock": _TRUTH,
        "scans": _WHOLE,
    },
    "trajectories": {
        # The velocity that counts, by setting; and which unbroken drive of the log this is.
        "speed_mps": _REAL,
        "negative_velocity": _TRUTH,
        "drive": _WHOLE,
    },
    "scans": {
        # Pose of the body at the scan, and of the sensor on the body.
        "body_x_m": _REAL,
        "body_y_m": _REAL,
        "body_yaw_rad": _REAL,
        "mount_x_m": _REAL,
        "mount_y_m": _REAL,
        "mount_yaw_rad": _REAL,
    },
    "scenarios": {
        "negative_velocity_count": _WHOLE,
        "not_forward_count": _WHOLE,
        "reversing_s": _REAL,
        # How a terminal segment ended.
        "outcome": _TEXT,
        "environment_id": _TEXT,
    },
    "environments": {
        "path_in_free_fraction": _REAL,
        "closest_obstacle_m": _REAL,
        "visibility_m": _REAL,
        "dispersion": _REAL,
        "characteristic_dimension_m": _REAL,
        "tortuosity": _REAL,
        # Cells that counted as occupied although the robot drove there.
        "overridden_cells": _WHOLE,
        # Share of beam ends in cells that most beams looked through; null from a map.
        "contradicted_fraction": _REAL,
        # The night that synthesized it.
        "run_id": _TEXT,
    },
    "selections": {"count": _REAL, "environment_id": _TEXT},
    "episodes": {
        "simulator": _TEXT,
        "start_x_m": _REAL,
        "start_y_m": _REAL,
        "start_yaw_rad": _REAL,
        "goal_x_m": _REAL,
        "goal_y_m": _REAL,
    },
    # The night that asked.
    "difficulties": {"run_id": _TEXT},
    "policies": {"parent_id": _TEXT, "success_rate": _REAL, "mean_time_s": _REAL},
    "scorecard": {
        "value": _REAL,
        "low": _REAL,
        "high": _REAL,
        "real_value": _REAL,
        "real_low": _REAL,
        "real_high": _REAL,
        "p_value": _REAL,
        "real_p_value": _REAL,
    },
}

FILE_TABLES: Final = frozenset({"scorecard"})
"""Tables that a command writes into a folder of its caller's, and no store keeps."""

TABLES: Final = tuple(table for table in _REQUIRED if table not in FILE_TABLES)
"""Names of all tables of a store."""

_PANDAS_TYPES: Final = {_WHOLE: ("int64", "Int64"), _TRUTH: ("bool", "boolean")}


def table_schema(table: str) -> pa.Schema:
    """Give the columns of a table, with the metadata that every file carries.

    Raises:
        SchemaError: No table has this name.
    """
    if table not in _REQUIRED:
        raise SchemaError(f"no table is called {table!r}, expected one of {', '.join(TABLES)}")
    required = [pa.field(name, kind, nullable=False) for name, kind in _REQUIRED[table].items()]
    nullable = [pa.field(name, kind) for name, kind in _NULLABLE[table].items()]
    return pa.schema(
        required + nullable,
        metadata={VERSION_KEY: str(SCHEMA_VERSION).encode(), b"pandas": _pandas_metadata(table)},
    )


def check_schema(found: pa.Schema, table: str, *, source: str) -> None:
    """Check a file's columns against its table's.

    Raises:
        SchemaError: Another table, another release's columns, or no table of ours at all.
    """
    version = (found.metadata or {}).get(VERSION_KEY)
    if version is None or not version.isdigit():
        raise SchemaError(f"{source} carries no {VERSION_KEY.decode()}: it is none of our tables")
    if int(version) > SCHEMA_VERSION:
        raise SchemaError(
            f"{source} has schema version {int(version)}, this release knows versions up to "
            f"{SCHEMA_VERSION}"
        )
    expected = table_schema(table)
    if not found.equals(expected, check_metadata=False):
        differing = [
            name
            for name in dict.fromkeys([*expected.names, *found.names])
            if name not in found.names
            or name not in expected.names
            or not found.field(name).equals(expected.field(name))
        ]
        raise SchemaError(
            f"{source} is no {table} table: it differs in "
            f"{', '.join(differing) or 'the order of its columns'}"
        )


def _pandas_metadata(table: str) -> bytes:
    """Tell `pandas.read_parquet` which columns are nullable whole numbers or truth values."""
    columns = [
        {
            "name": name,
            "field_name": name,
            "pandas_type": _PANDAS_TYPES[kind][0],
            "numpy_type": _PANDAS_TYPES[kind][1],
            "metadata": None,
        }
        for name, kind in _NULLABLE[table].items()
        if kind in _PANDAS_TYPES
    ]
    described = {"index_columns": [], "column_indexes": [], "columns": columns}
    return json.dumps(described).encode()
