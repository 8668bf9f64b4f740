"""What homes are measured by: size, free space, widths, and what lies along paths in them."""

from collections.abc import Sequence

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from ses_core.arrays import BoolArray, FloatArray, IntArray
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid, cell_indices
from ses_core.robot_profile import JACKAL
from ses_core.worlds.pairs import sample_tasks, standing_places

COARSEST_M = 0.05
"""Maps finer than half of this are thinned out before they are measured."""

OPPOSITE = 1.5
"""A cell lies between opposite sides if its nearest obstacles are further apart than this many
clearances: 97 degrees, so that the branches into the corners of rooms are left out."""

BLOCK_AREA_M2 = 0.09
_WIDEST_M, _WIDTH_STEP_M = 4.0, 0.04


def home_statistics(world: World, *, pairs: int, seed: int) -> dict[str, float]:
    """Measure one home; what needs start-goal pairs is NaN where it has none."""
    grid = _thinned(world.grid)
    free = ~grid.cells
    rows, columns = np.nonzero(free)
    box = grid.cells[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    sides = sorted(side * grid.resolution for side in box.shape)
    clearance, widths = clearance_and_widths(grid)
    area = float(free.sum()) * grid.resolution**2
    places = standing_places(world.grid, JACKAL)
    largest = int(np.bincount(places.regions).max()) if len(places.regions) else 0
    _, blobs = ndimage.label(box, structure=np.ones((3, 3)))
    statistics = {
        "free area [m2]": area,
        "long side [m]": sides[1],
        "short side [m]": sides[0],
        "free fraction": float(1.0 - box.mean()),
        "standing fraction": BLOCK_AREA_M2 * largest / area,
        "obstacles per 100 m2": 100.0 * blobs / area,
        "mean clearance [m]": float(clearance[free].mean()),
        **{
            f"width {percent} % [m]": float(np.percentile(widths, percent))
            for percent in (10, 50, 90)
        },
    }
    tasks = sample_tasks(world, pairs, profile=JACKAL, rng=np.random.default_rng(seed))
    return statistics | path_statistics(grid, clearance, tasks)


def clearance_and_widths(grid: OccupancyGrid) -> tuple[FloatArray, FloatArray]:
    """Give the clearance (H, W) and the widths (K,) [m] between opposite sides.

    Widths are twice the clearance of the cells of the medial axis.
    """
    walled = np.pad(grid.cells, 1, constant_values=True)
    distance, nearest = ndimage.distance_transform_edt(~walled, return_indices=True)
    axis = np.zeros(walled.shape, dtype=np.bool_)
    for direction in (0, 1):
        here = np.moveaxis(nearest, direction + 1, 0)[:-1]
        there = np.moveaxis(nearest, direction + 1, 0)[1:]
        apart = np.linalg.norm(np.moveaxis(here - there, 1, -1).astype(np.float64), axis=-1)
        view = np.moveaxis(axis, direction, 0)[:-1]
        view |= apart > OPPOSITE * np.moveaxis(distance, direction, 0)[:-1].clip(min=2.0)
    clearance = np.maximum(distance - 0.5, 0.0)[1:-1, 1:-1] * grid.resolution
    on_axis = axis[1:-1, 1:-1] & ~grid.cells
    return clearance, 2.0 * clearance[on_axis]


def path_statistics(
    grid: OccupancyGrid, clearance: FloatArray, tasks: Sequence[NavigationTask]
) -> dict[str, float]:
    """Average over tasks what a robot meets on the shortest way its inscribed disc fits through.

    The bottleneck is the least width of the widest way.
    """
    rows = []
    for task in tasks:
        start, goal = cell_indices(grid, np.array([(task.start.x, task.start.y), task.goal]))
        path = _shortest_path(clearance >= JACKAL.inscribed_radius_m, start, goal)
        steps = np.hypot(*np.diff(path, axis=0).T).sum() * grid.resolution
        along = clearance[path[:, 0], path[:, 1]]
        straight = float(np.hypot(task.start.x - task.goal[0], task.start.y - task.goal[1]))
        rows.append((along.mean(), _bottleneck(clearance, start, goal), steps / straight, straight))
    means = np.mean(rows, axis=0) if rows else np.full(4, np.nan)
    names = ("path clearance [m]", "bottleneck [m]", "path over straight", "pair distance [m]")
    return dict(zip(names, means.tolist(), strict=True))


def _shortest_path(passable: BoolArray, start: IntArray, goal: IntArray) -> IntArray:
    """Give the cells (K, 2), (iy, ix), of a shortest way between cells given as (ix, iy)."""
    height, width = passable.shape
    cells = np.arange(passable.size).reshape(passable.shape)
    pairs = []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        here = cells[: height - down, max(0, -right) : width - max(0, right)]
        there = cells[down:, max(0, right) : width + min(0, right)]
        both = passable.flat[here] & passable.flat[there]
        pairs.append((here[both], there[both], np.full(int(both.sum()), np.hypot(down, right))))
    sources, targets, lengths = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    graph = sparse.csr_array((lengths, (sources, targets)), shape=(cells.size, cells.size))
    first, last = int(cells[start[1], start[0]]), int(cells[goal[1], goal[0]])
    _, before = csgraph.dijkstra(graph, directed=False, indices=first, return_predecessors=True)
    path = [last]
    while path[-1] != first:
        path.append(int(before[path[-1]]))
    return np.column_stack(np.divmod(np.array(path[::-1]), width))


def _bottleneck(clearance: FloatArray, start: IntArray, goal: IntArray) -> float:
    """Give the least width [m] along the widest way between two cells, by bisection."""
    low, high = 2.0 * JACKAL.inscribed_radius_m, _WIDEST_M
    while high - low > _WIDTH_STEP_M:
        middle = (low + high) / 2
        regions, _ = ndimage.label(2.0 * clearance >= middle, structure=np.ones((3, 3)))
        first, last = regions[start[1], start[0]], regions[goal[1], goal[0]]
        low, high = (middle, high) if first == last > 0 else (low, middle)
    return low


def _thinned(grid: OccupancyGrid) -> OccupancyGrid:
    step = max(1, int(COARSEST_M / grid.resolution + 1e-9))
    if step == 1:
        return grid
    height, width = (extent // step * step for extent in grid.cells.shape)
    blocks = grid.cells[:height, :width].reshape(height // step, step, width // step, step)
    return OccupancyGrid(
        cells=np.asarray(blocks.any(axis=(1, 3))),
        resolution=grid.resolution * step,
        origin=grid.origin,
    )
