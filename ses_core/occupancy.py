"""Occupancy grids and the one place where cells and metres are converted.

Two layouts exist and only this module knows both:

- `OccupancyGrid` is a map in a metric frame, laid out like `nav_msgs/OccupancyGrid`:
  `cells[iy, ix]` covers `origin + resolution * [ix, ix + 1) x [iy, iy + 1)`.
- *Environment cells* (30, 30) are a picture of a scenario: row 0 is the goal edge, column 0
  the left edge, so printing them shows the place with the goal on top. In the frame of a
  scenario (origin at the start, x towards the goal, y to the left) cell (row, column) is
  centred on x = (n - row - 1/2) * side / n, y = (n / 2 - column - 1/2) * side / n.
"""

from dataclasses import dataclass

import numpy as np

from ses_core.arrays import BoolArray, FloatArray, IntArray

ENVIRONMENT_SIDE_M = 5.0
"""Edge of a reconstructed environment [m] (section III-B)."""

ENVIRONMENT_CELLS = 30
"""Cells along that edge (section III-B)."""

ENVIRONMENT_RESOLUTION_M = ENVIRONMENT_SIDE_M / ENVIRONMENT_CELLS
"""Cell size [m/cell]: derived, never a second setting. The paper prints 1.5 m for about 0.15 m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OccupancyGrid:
    """A binary map: cells (H, W), True = occupied; origin = its lower left corner [m]."""

    cells: BoolArray
    resolution: float
    origin: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if self.cells.ndim != 2 or self.cells.size == 0:
            raise ValueError(f"grid has shape {self.cells.shape}, expected (H, W) with H, W > 0")
        if not (np.isfinite(self.resolution) and self.resolution > 0.0):
            raise ValueError(f"grid has resolution {self.resolution}, expected more than 0 m")

    @property
    def height_m(self) -> float:
        """Extent along y [m]."""
        return float(self.cells.shape[0] * self.resolution)

    @property
    def width_m(self) -> float:
        """Extent along x [m]."""
        return float(self.cells.shape[1] * self.resolution)


def cell_indices(grid: OccupancyGrid, points: FloatArray) -> IntArray:
    """Give (ix, iy) of the cells that hold points (N, 2) [m]; may lie outside the grid."""
    return np.floor((np.asarray(points) - grid.origin) / grid.resolution).astype(np.int64)


def cell_centres(grid: OccupancyGrid, indices: IntArray) -> FloatArray:
    """Give the centres (N, 2) [m] of cells given as (ix, iy)."""
    return np.asarray(grid.origin) + (np.asarray(indices) + 0.5) * grid.resolution


def occupied_at(grid: OccupancyGrid, points: FloatArray, *, outside: bool = True) -> BoolArray:
    """Tell which points (N, 2) [m] lie in occupied cells; `outside` answers beyond the map."""
    indices = cell_indices(grid, points)
    height, width = grid.cells.shape
    inside = (
        (indices[:, 0] >= 0)
        & (indices[:, 0] < width)
        & (indices[:, 1] >= 0)
        & (indices[:, 1] < height)
    )
    occupied = np.full(len(indices), outside)
    occupied[inside] = grid.cells[indices[inside, 1], indices[inside, 0]]
    return occupied


def environment_cell_centres() -> FloatArray:
    """Centres (30, 30, 2) [m] of environment cells in the frame of their scenario."""
    n = ENVIRONMENT_CELLS
    along = (n - np.arange(n) - 0.5) * ENVIRONMENT_RESOLUTION_M
    across = (n / 2 - np.arange(n) - 0.5) * ENVIRONMENT_RESOLUTION_M
    return np.stack(np.meshgrid(along, across, indexing="ij"), axis=-1)


def environment_to_grid(cells: BoolArray) -> OccupancyGrid:
    """Lay environment cells (n, n) out as a map in the frame of their scenario."""
    if cells.shape != (ENVIRONMENT_CELLS, ENVIRONMENT_CELLS):
        raise ValueError(f"environment has shape {cells.shape}, expected (30, 30)")
    return OccupancyGrid(
        cells=np.ascontiguousarray(cells[::-1, ::-1].T),
        resolution=ENVIRONMENT_RESOLUTION_M,
        origin=(0.0, -ENVIRONMENT_SIDE_M / 2.0),
    )


def grid_to_environment(grid: OccupancyGrid) -> BoolArray:
    """Give back the environment cells that `environment_to_grid` laid out."""
    return np.ascontiguousarray(grid.cells.T[::-1, ::-1])


def environment_course(cells: BoolArray, *, apron: float = 1.0) -> OccupancyGrid:
    """Close an environment's sides and give it open aprons [m] before the start and past the goal.

    The result is walled all round by one cell, so that whoever drives in it stays in it.
    """
    margin = int(np.ceil(apron / ENVIRONMENT_RESOLUTION_M))
    inner = environment_to_grid(cells)
    height, width = inner.cells.shape
    course = np.ones((height + 2, width + 2 * margin + 2), dtype=np.bool_)
    course[1:-1, 1:-1] = False
    course[1:-1, 1 + margin : 1 + margin + width] = inner.cells
    return OccupancyGrid(
        cells=course,
        resolution=inner.resolution,
        origin=(
            inner.origin[0] - (margin + 1) * inner.resolution,
            inner.origin[1] - inner.resolution,
        ),
    )


def draw(cells: BoolArray) -> str:
    """Draw cells (H, W) as text, row 0 on top: `#` occupied, `.` free."""
    return "\n".join("".join("#" if cell else "." for cell in row) for row in cells)


def from_drawing(text: str) -> BoolArray:
    """Read cells (H, W) from a drawing; anything but `#` is free."""
    rows = [row.strip() for row in text.strip().splitlines()]
    if len({len(row) for row in rows}) != 1:
        raise ValueError(f"drawing has rows of lengths {[len(row) for row in rows]}, expected one")
    return np.array([[cell == "#" for cell in row] for row in rows], dtype=np.bool_)
