"""NavFn's potential: what it costs to reach the goal through what has been seen."""

import math

import numpy as np

from ses_core.compilation import compiled_in_place
from ses_core.planning.costmap import INSCRIBED, LETHAL, RESOLUTION_M
from ses_core.simulation.state import Memory, Scratch, Slot

NEUTRAL_COST = 50.0
COST_FACTOR = 0.8
HIGHEST_COST = 253.0
"""NavFn's cost of a free cell, weight of the costmap's, and highest cost of a passable cell."""

UNREACHED = np.float32(1e10)
"""Potential where the search has not been."""

_WAVE_STEP = 2.0 * NEUTRAL_COST
_START_RADIUS_CELLS = 7.0
_SQRT_HALF = math.sqrt(0.5)


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

    Cells are worked off in waves of rising potential plus straight distance to the robot,
    each cell interpolating between its two lowest neighbours, as NavFn does.
    """
    width, height = slot.map_width, slot.map_height
    potential = memory.potential[slot.map_offset : slot.map_offset + width * height]
    potential[:] = UNREACHED
    slot.search_tick = slot.tick
    start = cell_at(slot, slot.x, slot.y)
    goal = _open_cell_near(slot, memory, number, cell_at(slot, slot.goal_x, slot.goal_y), start)
    if goal < 0 or start < 0:
        return False
    is_pending = scratch.is_pending[worker]
    is_pending[: width * height] = 0
    waves = scratch.waves[worker]
    now, later, over = 0, 1, 2
    now_size, later_size, over_size = 0, 0, 0
    start_column, start_row = start % width, start // width
    threshold = LETHAL + NEUTRAL_COST * math.hypot(
        goal % width - start_column, goal // width - start_row
    )
    potential[goal] = 0.0
    for neighbour in (goal - 1, goal + 1, goal - width, goal + width):
        waves[now, now_size] = neighbour
        is_pending[neighbour] = 1
        now_size += 1
    while now_size > 0 or over_size > 0:
        for k in range(now_size):
            is_pending[waves[now, k]] = 0
        for k in range(now_size):
            cell = waves[now, k]
            column, row = cell % width, cell // width
            if column < 1 or row < 1 or column >= width - 1 or row >= height - 1:
                continue
            cost = entering_cost(slot, memory, number, cell, start)
            if cost == 0.0:
                continue
            left, right = potential[cell - 1], potential[cell + 1]
            below, above = potential[cell - width], potential[cell + width]
            value = _interpolate(min(left, right), min(below, above), cost)
            if value >= potential[cell]:
                continue
            potential[cell] = value
            ahead = value + NEUTRAL_COST * math.hypot(column - start_column, row - start_row)
            gain = value + _SQRT_HALF * cost
            for neighbour, known in (
                (cell - 1, left),
                (cell + 1, right),
                (cell - width, below),
                (cell + width, above),
            ):
                if known > gain and is_pending[neighbour] == 0:
                    is_pending[neighbour] = 1
                    if ahead < threshold:
                        waves[later, later_size] = neighbour
                        later_size += 1
                    else:
                        waves[over, over_size] = neighbour
                        over_size += 1
        now, later = later, now
        now_size, later_size = later_size, 0
        if now_size == 0:
            if potential[start] < UNREACHED:
                return True
            threshold += _WAVE_STEP
            now, over = over, now
            now_size, over_size = over_size, 0
    return bool(potential[start] < UNREACHED)


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
