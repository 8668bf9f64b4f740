"""NavFn's potential: what it costs to reach the goal through what has been seen."""

import math

import numpy as np

from ses_core.arrays import ByteArray, Float32Array
from ses_core.compilation import compiled_in_place
from ses_core.planning.costmap import INSCRIBED, LETHAL, RESOLUTION_M
from ses_core.simulation.state import Int32Array, Memory, Scratch, Slot

NEUTRAL_COST = 50.0
COST_FACTOR = 0.8
HIGHEST_COST = 253.0
"""NavFn's cost of a free cell, weight of the costmap's, and highest cost of a passable cell."""

UNREACHED = np.float32(1e10)
"""Potential where the search has not been."""

_BUCKET_WIDTH = NEUTRAL_COST / 16.0
BUCKETS = 128
"""Entering a neighbour adds a passable cell at most, and moving off a cell of straight way: 97
buckets, so that a ring of these never meets its own tail."""

_SLACK = LETHAL
"""How much longer than the shortest way a way may be to be explored: the robot strays."""

_LEAST_GAIN = 0.03 * NEUTRAL_COST
"""Less is not passed on; with it potentials in the open stay within 1 to 3 % of the distance."""

_START_RADIUS_CELLS = 7.0


@compiled_in_place
def _passing_cost(cost: float) -> float:
    """Give NavFn's cost of entering a cell of a costmap cost."""
    return min(NEUTRAL_COST + COST_FACTOR * cost, HIGHEST_COST)


@compiled_in_place
def entering_cost(slot: Slot, memory: Memory, number: int, cell: int, start: int) -> float:
    """Give the cost of entering a cell, or 0 where it is barred.

    NavFn opens the robot's own cell; the cells around it are opened here too, at the highest
    cost, or a robot that came too near to a wall would never get a plan again.
    """
    cost = memory.costs[number][memory.distances[slot.map_offset + cell]]
    if cost < INSCRIBED:
        return _passing_cost(cost)
    if cost < LETHAL:
        away_row = cell // slot.map_width - start // slot.map_width
        away_column = cell % slot.map_width - start % slot.map_width
        if away_row * away_row + away_column * away_column <= _START_RADIUS_CELLS**2:
            return HIGHEST_COST
    return 0.0


@compiled_in_place
def spread_potential(
    slot: Slot, memory: Memory, number: int, scratch: Scratch, worker: int
) -> bool:
    """Spread NavFn's potential from the goal until it reaches the robot (its A* form).

    Each cell interpolates between its two lowest neighbours, as in NavFn. But cells are worked
    off in order of potential plus straight way to the robot, a sixteenth of a free cell at a time:
    NavFn's three waves pass over the same cells again and again. And only what the last search
    has reached is forgotten: a house has half a million cells, most of them in no cache.
    """
    width, height = slot.map_width, slot.map_height
    potential = memory.potential[slot.map_offset : slot.map_offset + width * height]
    _forget(slot, potential)
    slot.search_tick = slot.tick
    start = cell_at(slot, slot.x, slot.y)
    goal = _open_cell_near(slot, memory, number, cell_at(slot, slot.goal_x, slot.goal_y), start)
    if goal < 0 or start < 0:
        return False
    ends, links, bucket_of = (
        scratch.bucket_ends[worker],
        scratch.links[worker],
        scratch.bucket_of[worker],
    )
    start_column, start_row = start % width, start // width
    column, row = goal % width, goal // width
    slot.reached_left, slot.reached_right = column, column
    slot.reached_bottom, slot.reached_top = row, row
    potential[goal] = 0.0
    current = int(_straight_cost(column - start_column, row - start_row) / _BUCKET_WIDTH)
    _put(ends, links, bucket_of, goal, current)
    empty = 0
    while empty < BUCKETS and current * _BUCKET_WIDTH <= potential[start] + _SLACK:
        cell = ends[current % BUCKETS, 0]
        if cell < 0:
            current += 1
            empty += 1
            continue
        empty = 0
        _take_out(ends, links, bucket_of, cell)
        value, cell_column, cell_row = potential[cell], cell % width, cell // width
        for across, up in ((-1, 0), (1, 0), (0, -1), (0, 1)):
            neighbour = cell + up * width + across
            if potential[neighbour] <= value:
                continue
            column, row = cell_column + across, cell_row + up
            if column < 1 or row < 1 or column >= width - 1 or row >= height - 1:
                continue
            cost = entering_cost(slot, memory, number, neighbour, start)
            if cost == 0.0 or not _lower(potential, neighbour, width, cost):
                continue
            _widen_reach(slot, column, row)
            ahead = potential[neighbour] + _straight_cost(column - start_column, row - start_row)
            bucket = max(int(ahead / _BUCKET_WIDTH), current)
            _take_out(ends, links, bucket_of, neighbour)
            _put(ends, links, bucket_of, neighbour, bucket)
    _empty_buckets(ends, links, bucket_of)
    return bool(potential[start] < UNREACHED)


@compiled_in_place
def _forget(slot: Slot, potential: Float32Array) -> None:
    """Take back what the last search has written."""
    for row in range(slot.reached_bottom, slot.reached_top + 1):
        first = row * slot.map_width
        for column in range(slot.reached_left, slot.reached_right + 1):
            potential[first + column] = UNREACHED


@compiled_in_place
def _widen_reach(slot: Slot, column: int, row: int) -> None:
    slot.reached_left = min(slot.reached_left, column)
    slot.reached_right = max(slot.reached_right, column)
    slot.reached_bottom = min(slot.reached_bottom, row)
    slot.reached_top = max(slot.reached_top, row)


@compiled_in_place
def _straight_cost(columns: int, rows: int) -> float:
    """Give the cost of a straight way through free cells."""
    return NEUTRAL_COST * math.sqrt(columns * columns + rows * rows)


@compiled_in_place
def _put(ends: Int32Array, links: Int32Array, bucket_of: ByteArray, cell: int, bucket: int) -> None:
    """Put a cell at the end of a bucket: a list through `links` (see `Scratch`)."""
    place = bucket % BUCKETS
    last = ends[place, 1]
    links[cell, 0], links[cell, 1] = last, -1
    if last < 0:
        ends[place, 0] = cell
    else:
        links[last, 1] = cell
    ends[place, 1] = cell
    bucket_of[cell] = place + 1


@compiled_in_place
def _take_out(ends: Int32Array, links: Int32Array, bucket_of: ByteArray, cell: int) -> None:
    """Take a cell out of the bucket it is in, if any."""
    if bucket_of[cell] == 0:
        return
    place = np.int64(bucket_of[cell]) - 1
    before, after = links[cell, 0], links[cell, 1]
    if before < 0:
        ends[place, 0] = after
    else:
        links[before, 1] = after
    if after < 0:
        ends[place, 1] = before
    else:
        links[after, 0] = before
    bucket_of[cell] = 0


@compiled_in_place
def _empty_buckets(ends: Int32Array, links: Int32Array, bucket_of: ByteArray) -> None:
    for place in range(BUCKETS):
        cell = ends[place, 0]
        while cell >= 0:
            bucket_of[cell] = 0
            cell = links[cell, 1]
        ends[place, 0], ends[place, 1] = -1, -1


@compiled_in_place
def _lower(potential: Float32Array, cell: int, width: int, cost: float) -> bool:
    """Lower a cell's potential to what its neighbours allow; tell whether that was worth it."""
    value = _interpolate(
        min(potential[cell - 1], potential[cell + 1]),
        min(potential[cell - width], potential[cell + width]),
        cost,
    )
    if value > potential[cell] - _LEAST_GAIN:
        return False
    potential[cell] = value
    return True


@compiled_in_place
def _interpolate(across: float, along: float, cost: float) -> float:
    """Give a cell's potential from its lowest neighbours on both axes (NavFn's quadratic)."""
    low, high = min(across, along), max(across, along)
    if high - low >= cost:
        return low + cost
    share = (high - low) / cost
    return low + cost * (-0.2301 * share * share + 0.5307 * share + 0.7040)


@compiled_in_place
def cell_at(slot: Slot, x: float, y: float) -> int:
    """Give the map cell that holds a point [m], or -1 at or beyond the map's rim."""
    column = math.floor((x - slot.map_x) / RESOLUTION_M)
    row = math.floor((y - slot.map_y) / RESOLUTION_M)
    if not (1 <= column < slot.map_width - 1 and 1 <= row < slot.map_height - 1):
        return -1
    return row * slot.map_width + column


@compiled_in_place
def _open_cell_near(slot: Slot, memory: Memory, number: int, cell: int, start: int) -> int:
    """Give the nearest passable cell within 1 m of a cell, or -1.

    The goal of an environment may lie in an inscribed cell although the robot need only come
    within 1 m of it; NavFn alone would then have no plan at all.
    """
    if cell < 0:
        return -1
    column, row = cell % slot.map_width, cell // slot.map_width
    reach = int(1.0 / RESOLUTION_M)
    best, least = -1, reach * reach + 1
    for cell_row in range(max(row - reach, 1), min(row + reach + 1, slot.map_height - 1)):
        for cell_column in range(
            max(column - reach, 1), min(column + reach + 1, slot.map_width - 1)
        ):
            away = (cell_row - row) ** 2 + (cell_column - column) ** 2
            other = cell_row * slot.map_width + cell_column
            if away < least and entering_cost(slot, memory, number, other, start) > 0.0:
                best, least = other, away
    return best
