"""`worlds.parquet`: worlds as rows of a table."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ses_core.errors import SchemaError, WorldError
from ses_core.geometry import Pose2D
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid

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
    try:
        with pq.ParquetFile(file, page_checksum_verification=True) as parquet:
            if not parquet.schema_arrow.equals(_SCHEMA):
                raise SchemaError(
                    f"{file} has other columns than a world set of version {_SCHEMA_VERSION}"
                )
            rows = parquet.read().to_pylist()
    except (pa.ArrowException, OSError) as error:
        raise WorldError(f"{file} cannot be read as a world set: {error}") from error
    return [_world(row, file) for row in rows]


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
    height, width = row["height_cells"], row["width_cells"]
    packed = np.frombuffer(row["cells"], dtype=np.uint8)
    if height < 1 or width < 1 or len(packed) != -(-height * width // 8):
        raise WorldError(
            f"{file} has {len(packed)} bytes of cells in world {row['world_id']}, "
            f"expected {height} x {width} cells"
        )
    cells = np.unpackbits(packed, count=height * width).reshape(height, width).astype(np.bool_)
    course = None
    if row["start_x_m"] is not None:
        start = Pose2D(row["start_x_m"], row["start_y_m"], row["start_yaw_rad"])
        course = (start, (row["goal_x_m"], row["goal_y_m"]))
    return World(
        world_id=row["world_id"],
        grid=OccupancyGrid(
            cells=cells,
            resolution=row["resolution_m"],
            origin=(row["origin_x_m"], row["origin_y_m"]),
        ),
        name=row["name"],
        source=row["source"],
        course=course,
    )
