"""The global plan over what has been seen (NavfnROS), and the shortest way on a true map."""

import heapq
import math

import numpy as np
from scipy.ndimage import distance_transform_edt

from ses_core.arrays import BoolArray, Float32Array, FloatArray
from ses_core.compilation import compiled, compiled_in_place
from ses_core.occupancy import OccupancyGrid, cell_indices
from ses_core.planning.costmap import RESOLUTION_M
from ses_core.planning.potential import (
    NEUTRAL_COST,
    UNREACHED,
    cell_at,
    entering_cost,
    spread_potential,
)
from ses_core.simulation.state import Memory, Scratch, Slot

SEARCH_EVERY = 2
"""Ticks between searches: the Jackal's global costmap brings news at 10 Hz."""

PLAN_CAPACITY = 1200
PLAN_REACH_M = 5.3
"""The plan is followed until it leaves the local costmap (5 m) or is 1200 half cells long."""


@compiled_in_place
def update_plan(
    slot: Slot,
    memory: Memory,
    number: int,
    scratch: Scratch,
    worker: int,
    largest_age: int,
) -> None:
    """Follow the potential from where the robot is; compute it anew where it no longer holds.

    move_base plans anew at 20 Hz. The same plans come cheaper: what the laser finds can only make
    ways longer, so the potential holds as long as the way it leads along costs what it promised.
    It is computed anew when that fails, when the inflation radius changed, and after
    `largest_age` ticks, because marks can also be cleared; but no sooner than after
    `SEARCH_EVERY` ticks. Without any way the last plan stays.
    """
    age = slot.tick - slot.search_tick
    is_found = not slot.search_needed
    may_search = age >= SEARCH_EVERY
    if age >= largest_age or (slot.search_needed and may_search):
        is_found = spread_potential(slot, memory, number, scratch, worker)
        may_search = False
    is_followed = is_found and _follow(slot, memory, number)
    if is_found and not is_followed and may_search:
        is_followed = spread_potential(slot, memory, number, scratch, worker) and _follow(
            slot, memory, number
        )
    slot.search_needed = not is_followed
    if is_followed:
        slot.has_plan = True
        slot.plan_tick = slot.tick
    _point_ahead(slot, memory, number)


@compiled_in_place
def _follow(slot: Slot, memory: Memory, number: int) -> bool:
    """Write the plan ahead of the robot; False where the potential no longer tells the truth."""
    width, height = slot.map_width, slot.map_height
    potential = memory.potential[slot.map_offset : slot.map_offset + width * height]
    start = cell_at(slot, slot.x, slot.y)
    if start < 0 or potential[start] >= UNREACHED:
        return False
    plan = memory.plans[number]
    start_x = (slot.x - slot.map_x) / RESOLUTION_M
    start_y = (slot.y - slot.map_y) / RESOLUTION_M
    x, y = start_x, start_y
    cell = start
    promised, paid, size = float(potential[start]), 0.0, 0
    reach = (PLAN_REACH_M / RESOLUTION_M) ** 2
    while size < PLAN_CAPACITY:
        plan[size, 0], plan[size, 1] = x, y
        size += 1
        if potential[cell] < NEUTRAL_COST or (x - start_x) ** 2 + (y - start_y) ** 2 > reach:
            break
        next_x, next_y = _descend(potential, width, x, y, cell)
        column, row = int(next_x), int(next_y)
        if not (1 <= column < width - 1 and 1 <= row < height - 1):
            return False
        cell = row * width + column
        cost = entering_cost(slot, memory, number, cell, start)
        if cost == 0.0:
            return False
        paid += cost * math.hypot(next_x - x, next_y - y)
        x, y = next_x, next_y
    # Interpolation and the staircase of barred cells make a few per cent of difference.
    if paid > 1.15 * (promised - float(potential[cell])) + 4.0 * NEUTRAL_COST:
        return False
    slot.plan_size = size
    return True


@compiled_in_place
def _descend(
    potential: Float32Array, width: int, x: float, y: float, cell: int
) -> tuple[float, float]:
    """Go half a cell down the potential's gradient, or to the lowest neighbour without one."""
    column, row = int(x - 0.5), int(y - 0.5)
    share_x, share_y = x - 0.5 - column, y - 0.5 - row
    slope_x, slope_y = 0.0, 0.0
    is_smooth = True
    for up in range(2):
        for across in range(2):
            corner = (row + up) * width + column + across
            left, right = potential[corner - 1], potential[corner + 1]
            below, above = potential[corner - width], potential[corner + width]
            if max(max(left, right), max(below, above)) >= UNREACHED:
                is_smooth = False
            else:
                weight = (share_x if across else 1.0 - share_x) * (share_y if up else 1.0 - share_y)
                slope_x += weight * (left - right)
                slope_y += weight * (below - above)
    steepness = math.hypot(slope_x, slope_y)
    if is_smooth and steepness > 0.0:
        next_x, next_y = x + 0.5 * slope_x / steepness, y + 0.5 * slope_y / steepness
        if potential[int(next_y) * width + int(next_x)] <= potential[cell]:
            return next_x, next_y
    best = cell
    for other_row in range(-1, 2):
        for other_column in range(-1, 2):
            other = cell + other_row * width + other_column
            if potential[other] < potential[best]:
                best = other
    return best % width + 0.5, best // width + 0.5


@compiled_in_place
def _point_ahead(slot: Slot, memory: Memory, number: int) -> None:
    """Set the local goal: the first point of the plan more than 1 m away, else its end."""
    plan = memory.plans[number]
    slot.local_goal_x, slot.local_goal_y = slot.goal_x, slot.goal_y
    for k in range(slot.plan_size):
        x = slot.map_x + plan[k, 0] * RESOLUTION_M
        y = slot.map_y + plan[k, 1] * RESOLUTION_M
        if math.hypot(x - slot.x, y - slot.y) > 1.0:
            slot.local_goal_x, slot.local_goal_y = x, y
            return


def optimal_path_length(
    grid: OccupancyGrid,
    start: tuple[float, float],
    goal: tuple[float, float],
    *,
    radius: float,
) -> float:
    """Give the length [m] of the shortest 8-connected way of a disc on the true map.

    It enters no cell whose centre is within the radius [m] of an occupied one's; `start` and
    `goal` are points [m].

    Returns:
        The length, or inf where there is no way.
    """
    walled = np.pad(grid.cells, 1, constant_values=True)
    free = distance_transform_edt(~walled, sampling=grid.resolution) > radius
    ends = cell_indices(grid, np.array([start, goal], dtype=np.float64)) + 1
    if np.any(ends < 0) or np.any(ends >= np.array(free.shape[::-1])):
        return math.inf
    (start_x, start_y), (goal_x, goal_y) = ends
    cells = _shortest_way(free, int(start_x), int(start_y), int(goal_x), int(goal_y))
    return float(cells * grid.resolution)


@compiled
def _shortest_way(free: BoolArray, start_x: int, start_y: int, goal_x: int, goal_y: int) -> float:
    """Search with A* on 8 neighbours, not cutting corners; the length is in cells."""
    height, width = free.shape
    if not (free[start_y, start_x] and free[goal_y, goal_x]):
        return math.inf
    lengths: FloatArray = np.full((height, width), math.inf)
    lengths[start_y, start_x] = 0.0
    queue = [(math.hypot(goal_x - start_x, goal_y - start_y), start_x, start_y)]
    is_done = np.zeros((height, width), dtype=np.bool_)
    while len(queue) > 0:
        _, x, y = heapq.heappop(queue)
        if x == goal_x and y == goal_y:
            return float(lengths[y, x])
        if is_done[y, x]:
            continue
        is_done[y, x] = True
        for step_y in range(-1, 2):
            for step_x in range(-1, 2):
                next_x, next_y = x + step_x, y + step_y
                # The map is walled all round, so a free cell's neighbours exist.
                if not (free[next_y, next_x] and free[y, next_x] and free[next_y, x]):
                    continue
                length = lengths[y, x] + math.sqrt(step_x * step_x + step_y * step_y)
                if length < lengths[next_y, next_x]:
                    lengths[next_y, next_x] = length
                    rest = math.hypot(goal_x - next_x, goal_y - next_y)
                    heapq.heappush(queue, (length + rest, next_x, next_y))
    return math.inf
