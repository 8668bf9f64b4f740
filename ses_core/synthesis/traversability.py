"""Can a disc get through an environment, and which way is shortest.

The disc has the target robot's padded inscribed radius. It starts on the bottom middle of the
environment and has to get to the top middle; the sides are closed and both ends have an open
apron of 1 m (`ses_core.occupancy.environment_course`).

`traversable` is exact. Two occupied squares less than a diameter apart let no disc between
them; the disc is kept from the goal if and only if squares chained like that lead from the
left side to the right one, or the start or the goal itself is too near to a square. That
holds while nothing can be chained to the far ends of the aprons: below `RADIUS_LIMIT_M`.

`shortest_path` works on a lattice of nodes 2.1 cm apart whose clearance is exact. A passage
that the disc fits into with less than that to spare may have no path on it.
"""

import heapq
import math

import numpy as np
from scipy import ndimage

from ses_core.arrays import BoolArray, FloatArray, IntArray
from ses_core.compilation import compiled
from ses_core.occupancy import (
    ENVIRONMENT_CELLS,
    ENVIRONMENT_RESOLUTION_M,
    ENVIRONMENT_SIDE_M,
    OccupancyGrid,
    environment_course,
)

RADIUS_LIMIT_M = 0.5
"""A disc of this radius [m] could touch an obstacle and the far end of an apron at once."""

NODES_PER_CELL = 8
"""Nodes of the path lattice along the side of a cell."""

_MOST_PULLS = 20

_EPSILON = 1e-9
"""So that a gap of exactly one diameter can be passed, whatever the rounding."""


def traversable(cells: BoolArray, *, radius: float) -> BoolArray:
    """Tell which environments (N, 30, 30) a disc of a radius [m] can cross: (N,).

    Raises:
        ValueError: The cells are no stack of environments, or the radius is out of range.
    """
    radius_cells = radius_in_cells(radius)
    check_stack(cells)
    answers = np.zeros(len(cells), dtype=np.bool_)
    _decide(np.ascontiguousarray(cells, dtype=np.bool_), radius_cells, answers)
    return answers


def radius_in_cells(radius: float) -> float:
    """Give a disc's radius in cells: squares less than twice this apart close a gap.

    Raises:
        ValueError: The radius [m] is out of range.
    """
    _check_radius(radius)
    return radius / ENVIRONMENT_RESOLUTION_M - _EPSILON


def check_stack(cells: BoolArray) -> None:
    """Refuse what is no stack of environments (N, 30, 30).

    Raises:
        ValueError: The shape is another.
    """
    if cells.ndim != 3 or cells.shape[1:] != (ENVIRONMENT_CELLS, ENVIRONMENT_CELLS):
        raise ValueError(f"environments have shape {cells.shape}, expected (N, 30, 30)")


@compiled
def _decide(cells: BoolArray, radius: float, answers: BoolArray) -> None:
    """Decide every environment; `radius` is in cells."""
    for index in range(cells.shape[0]):
        answers[index] = _has_free_ends(cells[index], radius) and not _is_walled_off(
            cells[index], radius
        )


@compiled
def _has_free_ends(cells: BoolArray, radius: float) -> bool:
    """Tell whether the disc fits on the start and on the goal, the middles of both edges."""
    size = cells.shape[0]
    for row in range(size):
        for column in range(size):
            if cells[row, column]:
                across = max(abs(column + 0.5 - size / 2) - 0.5, 0.0)
                if math.hypot(across, min(row, size - 1 - row)) < radius:
                    return False
    return True


@compiled
def _is_walled_off(cells: BoolArray, radius: float) -> bool:
    """Tell whether squares chained by gaps below a diameter lead from side to side."""
    size = cells.shape[0]
    reach = math.floor(2.0 * radius) + 1
    chained = np.zeros((size, size), dtype=np.bool_)
    rows = np.empty(size * size, dtype=np.int64)
    columns = np.empty(size * size, dtype=np.int64)
    count = 0
    for column in range(min(reach, size)):
        for row in range(size):
            if cells[row, column] and column < 2.0 * radius:
                chained[row, column] = True
                rows[count], columns[count] = row, column
                count += 1
    done = 0
    while done < count:
        row, column = rows[done], columns[done]
        done += 1
        if size - 1 - column < 2.0 * radius:
            return True
        for r in range(max(row - reach, 0), min(row + reach + 1, size)):
            for c in range(max(column - reach, 0), min(column + reach + 1, size)):
                if cells[r, c] and not chained[r, c]:
                    gap = math.hypot(max(abs(r - row) - 1, 0), max(abs(c - column) - 1, 0))
                    if gap < 2.0 * radius:
                        chained[r, c] = True
                        rows[count], columns[count] = r, c
                        count += 1
    return False


def shortest_path(cells: BoolArray, radius: float) -> FloatArray | None:
    """Find the shortest way of a disc's centre from start to goal.

    Args:
        cells: (30, 30), True = occupied.
        radius: Of the disc [m].

    Returns:
        Points (P, 2) [m] about 2 cm apart in the frame of the scenario, or None if the disc
        cannot get there.

    Raises:
        ValueError: The radius is out of range.
    """
    course = environment_course(cells)
    return path_through(course, node_clearance(course), radius)


def path_through(course: OccupancyGrid, clearance: FloatArray, radius: float) -> FloatArray | None:
    """Find the shortest way through a course whose `node_clearance` is known already."""
    _check_radius(radius)
    free = clearance >= radius - _EPSILON
    spacing = course.resolution / NODES_PER_CELL
    start = np.rint((np.array([0.0, 0.0]) - course.origin) / spacing).astype(np.int64)
    goal = np.rint((np.array([ENVIRONMENT_SIDE_M, 0.0]) - course.origin) / spacing).astype(np.int64)
    parents = _search(free, int(start[0]), int(start[1]), int(goal[0]), int(goal[1]))
    nodes = _walk_back(parents, int(goal[0]), int(goal[1]))
    if len(nodes) == 0:
        return None
    return np.asarray(course.origin) + _tightened(free, nodes.astype(np.float64)) * spacing


def node_clearance(course: OccupancyGrid) -> FloatArray:
    """Distance [m] from every lattice node (iy, ix) of a course to its nearest occupied square.

    Nodes lie on the corners and sides of the squares, so the point of a square nearest to a
    node is a node too, and the distance transform between nodes is exact.
    """
    fine = np.kron(course.cells, np.ones((NODES_PER_CELL, NODES_PER_CELL), dtype=np.bool_))
    occupied = np.zeros((fine.shape[0] + 1, fine.shape[1] + 1), dtype=np.bool_)
    for dy in (0, 1):
        for dx in (0, 1):
            occupied[dy : dy + fine.shape[0], dx : dx + fine.shape[1]] |= fine
    distance: FloatArray = ndimage.distance_transform_edt(~occupied)
    return distance * (course.resolution / NODES_PER_CELL)


def _check_radius(radius: float) -> None:
    if not 0.0 < radius < RADIUS_LIMIT_M:
        raise ValueError(
            f"robot has an inscribed radius of {radius:.3f} m, "
            f"expected more than 0 and less than {RADIUS_LIMIT_M} m"
        )


@compiled
def _search(free: BoolArray, start_x: int, start_y: int, goal_x: int, goal_y: int) -> IntArray:
    """A* over 8 neighbours: the node each node was reached from, -1 where none was."""
    height, width = free.shape
    parents = np.full((height, width), -1, dtype=np.int64)
    if not (free[start_y, start_x] and free[goal_y, goal_x]):
        return parents
    costs = np.full((height, width), np.inf)
    is_done = np.zeros((height, width), dtype=np.bool_)
    costs[start_y, start_x] = 0.0
    parents[start_y, start_x] = start_y * width + start_x
    queue = [(0.0, start_y * width + start_x)]
    while queue:
        _, node = heapq.heappop(queue)
        y, x = node // width, node % width
        if is_done[y, x]:
            continue
        if y == goal_y and x == goal_x:
            return parents
        is_done[y, x] = True
        for dy in range(-1, 2):
            for dx in range(-1, 2):
                ny, nx = y + dy, x + dx
                if not (0 <= ny < height and 0 <= nx < width) or not free[ny, nx]:
                    continue
                cost = costs[y, x] + math.sqrt(dx * dx + dy * dy)
                if cost < costs[ny, nx] - 1e-12:
                    costs[ny, nx] = cost
                    parents[ny, nx] = node
                    ahead_x, ahead_y = abs(goal_x - nx), abs(goal_y - ny)
                    ahead = max(ahead_x, ahead_y) + 0.41421356 * min(ahead_x, ahead_y)
                    heapq.heappush(queue, (cost + ahead, ny * width + nx))
    parents[:] = -1
    return parents


@compiled
def _walk_back(parents: IntArray, goal_x: int, goal_y: int) -> IntArray:
    """Give the nodes (P, 2) as (ix, iy) from start to goal; none where there is no way."""
    width = parents.shape[1]
    nodes = np.empty((parents.size, 2), dtype=np.int64)
    count = 0
    y, x = goal_y, goal_x
    while parents[y, x] >= 0:
        nodes[count, 0], nodes[count, 1] = x, y
        count += 1
        node = parents[y, x]
        if node == y * width + x:
            break
        y, x = node // width, node % width
    return nodes[:count][::-1].copy()


def _tightened(free: BoolArray, path: FloatArray) -> FloatArray:
    """Pull a path (P, 2) [nodes] taut like a rope, from both ends in turn.

    Eight directions alone make a straight line up to 8 % too long.
    """
    length = math.inf
    for _ in range(_MOST_PULLS):
        path = _pull_taut(free, path)[::-1].copy()
        path = _pull_taut(free, path)[::-1].copy()
        steps = np.diff(path, axis=0)
        shorter = float(np.hypot(steps[:, 0], steps[:, 1]).sum())
        if shorter > length - 0.1:
            break
        length = shorter
    return path


@compiled
def _pull_taut(free: BoolArray, path: FloatArray) -> FloatArray:
    """Replace runs of points (P, 2) by straight lines wherever the disc fits along them."""
    points = [(path[0, 0], path[0, 1])]
    anchor = 0
    while anchor < path.shape[0] - 1:
        ahead = anchor + 1
        while ahead + 1 < path.shape[0] and _is_clear(free, path[anchor], path[ahead + 1]):
            ahead += 1
        dx, dy = path[ahead, 0] - path[anchor, 0], path[ahead, 1] - path[anchor, 1]
        steps = max(math.ceil(math.hypot(dx, dy)), 1)
        for step in range(1, steps + 1):
            share = step / steps
            points.append((path[anchor, 0] + share * dx, path[anchor, 1] + share * dy))
        anchor = ahead
    return np.array(points)


@compiled
def _is_clear(free: BoolArray, start: FloatArray, end: FloatArray) -> bool:
    """Tell whether the nodes nearest to a straight line, half a node apart, are all free."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    steps = 2 * max(math.ceil(math.hypot(dx, dy)), 1)
    for step in range(1, steps):
        share = step / steps
        if not free[round(start[1] + share * dy), round(start[0] + share * dx)]:
            return False
    return True
