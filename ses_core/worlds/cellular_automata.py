"""BARN's generator: cellular-automaton fields of obstacles behind an entry corridor.

Follows Perille et al., "Benchmarking metric ground navigation" (SSRR 2020) and its published
code (jackal-map-creation): a 30 x 30 field of 0.15 m cells is filled at random, smoothed, and
kept if a robot two cells in radius gets across. It then stands in BARN's course, in the
coordinates of BARN's Gazebo files: the robot drives along +y, from a walled corridor of 5 m
(y 0 to 5.1 m) through the field (5.1 to 9.6 m) to open ground behind it.

Indices of a field are (row, column): rows run across the course (x = -4.5 + 0.15 row), columns
along it (y = 5.1 + 0.15 column).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from ses_core.arrays import BoolArray, IntArray
from ses_core.geometry import Pose2D
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.identity import named_world

FIELD_CELLS = 30
CELL_M = 0.15
FILLS = (0.15, 0.20, 0.25, 0.30)
SMOOTHINGS = (2, 3, 4)
PARAMETER_SETS = tuple((fill, smoothing) for fill in FILLS for smoothing in SMOOTHINGS)
"""The 12 pairs of initial fill and smoothing passes; BARN has 25 worlds of each."""

COURSE_START = Pose2D(-2.25, 3.0, math.pi / 2)
"""Start of BARN's protocol (the-barn-challenge, run.py)."""

COURSE_GOAL = (-2.25, 13.0)
"""Its goal, 10 m ahead [m]."""

COURSE_ORIGIN = (-4.5, 0.0)
"""Lower left corner of the course [m], in the coordinates of BARN's Gazebo files."""

_CORRIDOR_CELLS = 34
FIELD_START_M = _CORRIDOR_CELLS * CELL_M
"""Where along y the corridor ends and the field begins [m]."""

_OPEN_CELLS = 30
COURSE_SHAPE = (_CORRIDOR_CELLS + FIELD_CELLS + _OPEN_CELLS, FIELD_CELLS)
"""Cells of the course along y and x."""

_ROBOT_CELLS = 2
_HEADINGS = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))
_PATH_CLEARANCE_CELLS = 2.0
_PATH_PENALTY = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GeneratedWorld:
    """A generated course and what its generator knows about it.

    Attributes:
        field: (30, 30), True = occupied; (row, column) as the module says.
        path: (K, 2) cells of the path that proves it can be crossed, column 0 to column 29.
        fill: Share of cells filled at first.
        smoothing: Passes of the automaton.
    """

    world: World
    field: BoolArray
    path: IntArray
    fill: float
    smoothing: int


def generate_barn(count: int, *, seed: int) -> list[GeneratedWorld]:
    """Generate worlds 0 to count - 1 of a seed; world i does not depend on the others.

    The parameter set of world i is the i-th of the 12, over and over.
    """
    return [generate_barn_world(index, seed=seed) for index in range(count)]


def generate_barn_world(index: int, *, seed: int) -> GeneratedWorld:
    """Generate one world, drawing fields until one can be crossed."""
    rng = np.random.default_rng([seed, index])
    fill, smoothing = PARAMETER_SETS[index % len(PARAMETER_SETS)]
    while True:
        field = grow_field(fill, smoothing, rng=rng)
        path = cross_field(field, rng=rng)
        if path is not None:
            break
    world = named_world(
        f"barn-{seed}-{index:04d}",
        barn_course(field),
        source="barn",
        course=(COURSE_START, COURSE_GOAL),
    )
    return GeneratedWorld(world=world, field=field, path=path, fill=fill, smoothing=smoothing)


def grow_field(fill: float, smoothing: int, *, rng: Generator) -> BoolArray:
    """Fill a field (30, 30) at random and smooth it.

    Per pass a cell with 5 or more of its 8 neighbours filled is filled, one with at most 1 is
    cleared. Beyond the first and last row everything counts as filled, beyond the first and
    last column as empty; the first and last row, the course's side walls, stay filled.
    """
    field = rng.random((FIELD_CELLS, FIELD_CELLS)) < fill
    field[[0, -1]] = True
    for _ in range(smoothing):
        padded = np.zeros((FIELD_CELLS + 2, FIELD_CELLS + 2), dtype=np.int64)
        padded[[0, -1]] = 1
        padded[1:-1, 1:-1] = field
        neighbours = ndimage.convolve(padded, np.ones((3, 3), dtype=np.int64))[1:-1, 1:-1] - field
        field = np.where(neighbours >= 5, True, np.where(neighbours <= 1, False, field))
        field[[0, -1]] = True
    return field


def cross_field(field: BoolArray, *, rng: Generator) -> IntArray | None:
    """Find the path (K, 2) of a robot that covers 5 x 5 cells, or None where there is none.

    Start and goal are random cells of the regions of free configuration space that fill most
    of the first and of the last column.
    """
    blocked = ndimage.binary_dilation(
        field, structure=np.ones((2 * _ROBOT_CELLS + 1, 2 * _ROBOT_CELLS + 1), dtype=np.bool_)
    )
    labels, _ = ndimage.label(~blocked, structure=np.ones((3, 3), dtype=np.int64))
    regions = labels.astype(np.int64)
    start_region, goal_region = _main_region(regions[:, 0]), _main_region(regions[:, -1])
    if start_region == 0 or start_region != goal_region:
        return None
    start = int(rng.choice(np.flatnonzero(regions[:, 0] == start_region)))
    goal = int(rng.choice(np.flatnonzero(regions[:, -1] == goal_region)))
    return smooth_path(blocked, (start, 0), (goal, FIELD_CELLS - 1))


def smooth_path(
    blocked: BoolArray, start: tuple[int, int], goal: tuple[int, int]
) -> IntArray | None:
    """Search for the cheapest path that turns by at most 45 degrees per cell.

    A state is a cell and the heading it was entered with; nearer than two cells to blocked
    configuration space a move costs a penalty of 5 / distance on top of its length.
    """
    size = blocked.size
    clearance = ndimage.distance_transform_edt(~blocked)
    near = (clearance > 0) & (clearance < _PATH_CLEARANCE_CELLS)
    penalty = np.zeros(blocked.shape)
    penalty[near] = _PATH_PENALTY / clearance[near]
    cells = np.arange(size).reshape(blocked.shape)
    sources, targets, costs = [], [], []
    for heading, (down, right) in enumerate(_HEADINGS):
        here, there = _neighbours(cells, down, right)
        free = ~(blocked.flat[here] | blocked.flat[there])
        here, there = here[free], there[free]
        cost = math.hypot(down, right) + penalty.flat[there]
        for entered in (heading - 1, heading, heading + 1):
            sources.append(here + size * (entered % 8))
            targets.append(there + size * heading)
            costs.append(cost)
    graph = sparse.csr_array(
        (np.concatenate(costs), (np.concatenate(sources), np.concatenate(targets))),
        shape=(8 * size, 8 * size),
    )
    states = size * np.arange(8)
    distances, predecessors, _ = csgraph.dijkstra(
        graph, indices=states + cells[start], return_predecessors=True, min_only=True
    )
    state = int(min(states + cells[goal], key=distances.__getitem__))
    if not np.isfinite(distances[state]):
        return None
    path = []
    while state >= 0:
        path.append(divmod(state % size, FIELD_CELLS))
        state = int(predecessors[state])
    return np.array(path[::-1], dtype=np.int64)


def barn_course(field: BoolArray) -> OccupancyGrid:
    """Stand a field (30, 30) behind BARN's corridor, with 4.5 m of open ground past it."""
    cells = np.zeros(COURSE_SHAPE, dtype=np.bool_)
    cells[0] = True
    cells[:_CORRIDOR_CELLS, [0, -1]] = True
    cells[_CORRIDOR_CELLS : _CORRIDOR_CELLS + FIELD_CELLS] = field.T
    return OccupancyGrid(cells=cells, resolution=CELL_M, origin=COURSE_ORIGIN)


def _main_region(column: IntArray) -> int:
    """Label of the region with most cells in a column, 0 if all of it is blocked."""
    sizes = np.bincount(column)
    sizes[0] = 0
    return int(sizes.argmax())


def _neighbours(cells: IntArray, down: int, right: int) -> tuple[IntArray, IntArray]:
    """Pair every cell with its neighbour (down, right) of it, where there is one."""
    height, width = cells.shape
    here = cells[
        max(0, -down) : height - max(0, down), max(0, -right) : width - max(0, right)
    ].ravel()
    return here, here + down * width + right
