"""The path search of BARN's generator, its habits included.

BARN's published paths are not the cheapest ones: the search that made them (jackal-map-creation,
`AStarSearch`) orders cells by length so far plus the penalty of that cell alone, adds the
estimate of what is left only once a cell is reached again by a shorter way, and never opens a
cell twice. Path length, tortuosity and whatever is averaged along a path depend on it, so it is
followed here, described anew: on BARN's 300 fields it gives BARN's 300 paths cell by cell.
"""

import heapq
import math

import numpy as np
from scipy import ndimage

from ses_core.arrays import BoolArray, IntArray

Cell = tuple[int, int]

PENALTY = 5.0
"""Cost of a cell beside blocked ones, over its distance from them [cells]."""

PENALTY_REACH_CELLS = 2.0
"""How far from blocked cells it is asked for: an inflation radius of 0.3 m."""

_HEADINGS: tuple[Cell, ...] = (
    (0, 1),
    (1, 1),
    (1, 0),
    (1, -1),
    (0, -1),
    (-1, -1),
    (-1, 0),
    (-1, 1),
)
"""Every neighbour is 45 degrees from the one before."""


def search_path(blocked: BoolArray, start: Cell, goal: Cell) -> IntArray | None:
    """Search a path through configuration space that turns by at most 45 degrees per cell.

    Args:
        blocked: (H, W) cells in which a robot's middle cannot be, at least one of them.
        start: (row, column).
        goal: (row, column).

    Returns:
        Cells (K, 2) from start to goal, or None where the search finds none.
    """
    rows, columns = blocked.shape
    clearance = ndimage.distance_transform_edt(~blocked)
    length, found, turned = {start: 0.0}, {start: 0}, {start: -1}
    parents: dict[Cell, Cell] = {}
    priority = {start: 0.0}
    queue = [(0.0, 0, start)]
    closed: set[Cell] = set()
    while queue:
        cost, _, cell = heapq.heappop(queue)
        if cell in closed or cost != priority[cell]:
            continue
        closed.add(cell)
        if cell == goal:
            return _walked_back(parents, goal)
        for heading in _allowed_headings(turned[cell]):
            down, right = _HEADINGS[heading]
            ahead = (cell[0] + down, cell[1] + right)
            if not (0 <= ahead[0] < rows and 0 <= ahead[1] < columns) or ahead in closed:
                continue
            corner_cut = blocked[ahead[0], cell[1]] and blocked[cell[0], ahead[1]]
            if blocked[ahead] or corner_cut:
                continue
            so_far = length[cell] + math.hypot(down, right)
            if so_far >= length.get(ahead, math.inf):
                continue
            near = clearance[ahead] <= PENALTY_REACH_CELLS
            priority[ahead] = so_far + (PENALTY / float(clearance[ahead]) if near else 0.0)
            if ahead in length:
                priority[ahead] += math.dist(ahead, goal)
            length[ahead], parents[ahead], turned[ahead] = so_far, cell, heading
            found.setdefault(ahead, len(found))
            heapq.heappush(queue, (priority[ahead], found[ahead], ahead))
    return None


def _allowed_headings(heading: int) -> tuple[int, ...]:
    """Give the headings a robot can leave a cell with, in the order they are tried.

    Among equals the one found first stays.
    """
    return tuple(range(8)) if heading < 0 else ((heading - 1) % 8, heading, (heading + 1) % 8)


def _walked_back(parents: dict[Cell, Cell], goal: Cell) -> IntArray:
    path = [goal]
    while path[-1] in parents:
        path.append(parents[path[-1]])
    return np.array(path[::-1], dtype=np.int64)
