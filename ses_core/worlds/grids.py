"""From what files hold (pictures, maps in turned frames) to the grids worlds have."""

import math

import numpy as np

from ses_core.arrays import BoolArray
from ses_core.errors import WorldError
from ses_core.geometry import Pose2D
from ses_core.occupancy import OccupancyGrid

MOST_CELLS = 64_000_000

_MOST_TOGETHER = 4_000_000_000
"""A cell takes a byte of memory; all 35 000 plans of HouseExpo have some 3 000 million."""

FINEST_M = 0.025
"""Maps finer than this are coarsened: floor plans of 1 cm pixels would cost 25 times the memory
and time of 5 cm ones, and no planner cell is finer."""

_COARSE_M = 0.05

_USABLE_M = (0.001, 10.0)
"""No map has cells of less than a millimetre, and none of more than a house's width is of use."""

_LEVEL_RAD = 1e-6


def require_usable(resolution: float) -> None:
    """Refuse a resolution [m per cell] that no map has.

    Raises:
        WorldError: It is none.
    """
    finest, coarsest = _USABLE_M
    if not finest <= resolution <= coarsest:
        raise WorldError(
            f"resolution is {resolution:g} m per cell, expected {finest:g} to {coarsest:g}"
        )


def require_together(cells: int) -> None:
    """Refuse worlds that have more cells together than fit into memory.

    Raises:
        WorldError: They have.
    """
    if cells > _MOST_TOGETHER:
        raise WorldError(
            f"these worlds have more than {_MOST_TOGETHER} cells together, expected fewer: read "
            "them in parts or with coarser cells"
        )


def coarsened(grid: OccupancyGrid) -> OccupancyGrid:
    """Give a grid no finer than needed; a cell is occupied if any part of it was.

    Raises:
        WorldError: No map has its resolution.
    """
    require_usable(grid.resolution)
    if grid.resolution >= FINEST_M:
        return grid
    factor = max(1, round(_COARSE_M / grid.resolution))
    height, width = (-(-extent // factor) for extent in grid.cells.shape)
    padded = np.ones((height * factor, width * factor), dtype=np.bool_)
    padded[: grid.cells.shape[0], : grid.cells.shape[1]] = grid.cells
    return OccupancyGrid(
        # Occupied if any part is: a thin wall must not leak.
        cells=np.asarray(padded.reshape(height, factor, width, factor).any(axis=(1, 3))),
        resolution=grid.resolution * factor,
        origin=grid.origin,
    )


def cut_to_free(grid: OccupancyGrid) -> OccupancyGrid:
    """Cut a grid down to what is free and one cell around.

    Raises:
        WorldError: Nothing is free.
    """
    if grid.cells.all():
        raise WorldError("no cell is free, expected some ground to drive on")
    rows, columns = (np.flatnonzero(~grid.cells.all(axis=axis)) for axis in (1, 0))
    bottom, left = max(0, rows[0] - 1), max(0, columns[0] - 1)
    return OccupancyGrid(
        cells=np.ascontiguousarray(grid.cells[bottom : rows[-1] + 2, left : columns[-1] + 2]),
        resolution=grid.resolution,
        origin=(
            grid.origin[0] + float(left) * grid.resolution,
            grid.origin[1] + float(bottom) * grid.resolution,
        ),
    )


def levelled(cells: BoolArray, resolution: float, origin: Pose2D) -> OccupancyGrid:
    """Lay a map whose lower left corner is a turned pose out along the axes of its frame.

    Quarter turns keep every cell; in between, a cell is what lies under its middle. Beyond the
    map is occupied.

    Raises:
        WorldError: The turned map would be too large.
    """
    turns = origin.yaw / (math.pi / 2.0)
    if abs(turns - round(turns)) * math.pi / 2.0 < _LEVEL_RAD:
        return _quarter_turned(cells, resolution, origin, round(turns) % 4)
    cosine, sine = math.cos(origin.yaw), math.sin(origin.yaw)
    height, width = cells.shape
    corners = np.array([(0, 0), (width, 0), (0, height), (width, height)]) * resolution
    turned = corners @ np.array([(cosine, sine), (-sine, cosine)])
    low, high = turned.min(axis=0), turned.max(axis=0)
    columns, rows = (int(cells) for cells in np.ceil((high - low) / resolution))
    if rows * columns > MOST_CELLS:
        raise WorldError(f"turned map has {columns} x {rows} cells, expected {MOST_CELLS}")
    level = np.ones((rows, columns), dtype=np.bool_)
    x = low[0] + (np.arange(columns) + 0.5) * resolution
    # Row by row: of a large map no whole coordinate arrays are made.
    for row in range(rows):
        y = low[1] + (row + 0.5) * resolution
        ix = np.floor((cosine * x + sine * y) / resolution).astype(np.int64)
        iy = np.floor((cosine * y - sine * x) / resolution).astype(np.int64)
        inside = (ix >= 0) & (ix < width) & (iy >= 0) & (iy < height)
        level[row, inside] = cells[iy[inside], ix[inside]]
    return OccupancyGrid(
        cells=level,
        resolution=resolution,
        origin=(origin.x + float(low[0]), origin.y + float(low[1])),
    )


def _quarter_turned(
    cells: BoolArray, resolution: float, origin: Pose2D, turns: int
) -> OccupancyGrid:
    height, width = (extent * resolution for extent in cells.shape)
    shift_x, shift_y = ((0.0, 0.0), (-height, 0.0), (-width, -height), (0.0, -width))[turns]
    return OccupancyGrid(
        # Rows go up, so a positive turn is numpy's negative one.
        cells=np.ascontiguousarray(np.rot90(cells, -turns)),
        resolution=resolution,
        origin=(origin.x + shift_x, origin.y + shift_y),
    )
