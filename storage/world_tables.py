"""`worlds.parquet`: worlds as rows of a table."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ses_core.errors import LogError, SchemaError, WorldError
from ses_core.geometry import Pose2D
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.grids import MOST_CELLS, require_together
from storage.bounded_parquet import bounded_file

TABLE_SUFFIX: Final = ".parquet"

_SCHEMA_VERSION = "1"

_SCHEMA = pa.schema(
    [
        pa.field("world_id", pa.string(), nullable=False),
        pa.field("name", pa.string(), nullable=False),
        pa.field("source", pa.string(), nullable=False),
        # Row-major from the lowest y, 8 cells per byte, first cell in the highest bit.
        pa.field("cells", pa.binary(), nullable=False),
        pa.field("height_cells", pa.int64(), nullable=False),
        pa.field("width_cells", pa.int64(), nullable=False),
        pa.field("resolution_m", pa.float64(), nullable=False),
        pa.field("origin_x_m", pa.float64(), nullable=False),
        pa.field("origin_y_m", pa.float64(), nullable=False),
        pa.field("start_x_m", pa.float64()),
        pa.field("start_y_m", pa.float64()),
        pa.field("start_yaw_rad", pa.float64()),
        pa.field("goal_x_m", pa.float64()),
        pa.field("goal_y_m", pa.float64()),
        pa.field("width_m", pa.float64(), nullable=False),
        pa.field("height_m", pa.float64(), nullable=False),
        pa.field("free_fraction", pa.float64(), nullable=False),
    ],
    metadata={"ses.schema_version": _SCHEMA_VERSION},
)


_COURSE = ("start_x_m", "start_y_m", "start_yaw_rad", "goal_x_m", "goal_y_m")

_MOST_BYTES = 1 << 30
"""Cells are packed: eight times as many as are read together."""
_ROWS_AT_ONCE = 16


def write_world_table(file: Path, worlds: Sequence[World]) -> None:
    """Write worlds as the rows of a table."""
    pq.write_table(
        pa.Table.from_pylist([_row(world) for world in worlds], schema=_SCHEMA),
        file,
        compression="zstd",
        write_page_checksum=True,
    )


def read_world_table(file: Path) -> list[World]:
    """Read the worlds of a table.

    Raises:
        SchemaError: It has other columns.
        WorldError: It cannot be read.
    """
    worlds: list[World] = []
    held = cells = 0
    try:
        with bounded_file(file, file.stem, check=_check, byte_limit=_MOST_BYTES) as parquet:
            # A few rows at a time: one long text can be that of a million rows.
            for batch in parquet.iter_batches(batch_size=_ROWS_AT_ONCE, use_threads=False):
                held += batch.nbytes
                if held > _MOST_BYTES:
                    raise WorldError(f"{file} unpacks to more than {_MOST_BYTES >> 20} MiB")
                worlds += (_world(row, file) for row in batch.to_pylist())
                cells += sum(world.grid.cells.size for world in worlds[-batch.num_rows :])
                require_together(cells)
    except LogError as error:
        kind = SchemaError if error.reason == "schema_conflict" else WorldError
        raise kind(f"{file} cannot be read as a world set: {error}") from error
    return worlds


def _check(schema: pa.Schema) -> None:
    if not schema.equals(_SCHEMA):
        raise SchemaError(f"it has other columns than one of version {_SCHEMA_VERSION}")


def _row(world: World) -> dict[str, object]:
    grid = world.grid
    start, goal = world.course or (None, None)
    return {
        "world_id": world.world_id,
        "name": world.name or world.world_id,
        "source": world.source,
        "cells": np.packbits(grid.cells).tobytes(),
        "height_cells": grid.cells.shape[0],
        "width_cells": grid.cells.shape[1],
        "resolution_m": grid.resolution,
        "origin_x_m": grid.origin[0],
        "origin_y_m": grid.origin[1],
        "start_x_m": start and start.x,
        "start_y_m": start and start.y,
        "start_yaw_rad": start and start.yaw,
        "goal_x_m": goal and goal[0],
        "goal_y_m": goal and goal[1],
        "width_m": grid.width_m,
        "height_m": grid.height_m,
        "free_fraction": float(np.mean(~grid.cells)),
    }


def _world(row: dict[str, Any], file: Path) -> World:
    if missing := [
        field.name for field in _SCHEMA if not field.nullable and row[field.name] is None
    ]:
        raise WorldError(f"{file} has a world without {missing[0]}, expected one in every row")
    height, width = row["height_cells"], row["width_cells"]
    packed = np.frombuffer(row["cells"], dtype=np.uint8)
    if not 0 < height * width <= MOST_CELLS:
        raise WorldError(
            f"{file} has {height} x {width} cells in world {row['world_id']}, expected at most "
            f"{MOST_CELLS}"
        )
    if height < 1 or width < 1 or len(packed) != -(-height * width // 8):
        raise WorldError(
            f"{file} has {len(packed)} bytes of cells in world {row['world_id']}, "
            f"expected {height} x {width} cells"
        )
    cells = np.unpackbits(packed, count=height * width).reshape(height, width).astype(np.bool_)
    resolution, origin = row["resolution_m"], (row["origin_x_m"], row["origin_y_m"])
    if not (0.0 < resolution < math.inf and all(map(math.isfinite, origin))):
        raise WorldError(
            f"{file} has resolution {resolution} and origin {origin} in world {row['world_id']}, "
            "expected more than 0 m and two numbers"
        )
    return World(
        world_id=row["world_id"],
        grid=OccupancyGrid(
            cells=cells,
            resolution=resolution,
            origin=origin,
        ),
        name=row["name"],
        source=row["source"],
        course=_course(row, file),
    )


def _course(row: dict[str, Any], file: Path) -> tuple[Pose2D, tuple[float, float]] | None:
    numbers = [row[name] for name in _COURSE]
    if all(number is None for number in numbers):
        return None
    if not all(number is not None and math.isfinite(number) for number in numbers):
        raise WorldError(
            f"{file} has start and goal {numbers} in world {row['world_id']}, expected five "
            "numbers or none"
        )
    x, y, yaw, goal_x, goal_y = numbers
    return Pose2D(x, y, yaw), (goal_x, goal_y)
