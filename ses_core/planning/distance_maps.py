"""Cells to the plan and to the local goal (base_local_planner's `MapGrid`): what samples cost."""

import math

import numpy as np

from ses_core.arrays import ByteArray, Float32Array
from ses_core.compilation import compiled_in_place
from ses_core.planning.costmap import (
    INSCRIBED,
    RESOLUTION_M,
    WINDOW_CELLS,
    WINDOW_SIZE,
    is_inside,
    window_place,
)
from ses_core.simulation.robot import RobotModel
from ses_core.simulation.state import Int32Array, Memory, Scratch, Slot, UInt16Array

UNREACHED = np.uint16(65535)
BLOCKED = np.uint16(65534)
_ONE, _ROW = np.uint64(1), np.uint64(WINDOW_SIZE)
_DETOUR_CELLS = 20
_PLAN_MARGIN_CELLS = 10

IMPOSSIBLE = 65534
"""From this value on, no way leads there."""


@compiled_in_place
def measure_distances(
    slot: Slot, memory: Memory, number: int, robot: RobotModel, scratch: Scratch, worker: int
) -> None:
    """Count the steps (4 neighbours) from window cells to the plan and to its last point.

    Cells with inscribed cost block the way, except under the robot itself. The plan counts up to
    where it leaves the window; its last point there is the local goal. The original counts over
    the whole window. Here the search for the plan stays within 0.5 m of the box that roll-outs
    can reach, so steps to the plan above 10 may come out too high; the one for the goal ends
    once it is farther than that box's corners behind the robot.
    """
    path, goal = memory.path_steps[number], memory.goal_steps[number]
    queue, plan = scratch.queue[worker], memory.plans[number]
    box = int(slot.rollout_reach / RESOLUTION_M) + 1
    middle = WINDOW_CELLS // 2 + 1  # the robot's cell when the window was centred
    low = max(middle - box - _PLAN_MARGIN_CELLS, 1)
    high = min(middle + box + _PLAN_MARGIN_CELLS, WINDOW_CELLS)
    _open_cells(memory.costs[number], memory.window_distances[number], goal)
    _open_footprint(slot, goal, robot)
    path[:] = BLOCKED
    for row in range(low, high + 1):
        for column in range(low, high + 1):
            path[row, column] = goal[row, column]
    size, last = 0, -1
    steps = path.reshape(path.size)
    for k in range(slot.plan_size):
        column = int(plan[k, 0]) - slot.window_column + 1
        row = int(plan[k, 1]) - slot.window_row + 1
        if not (1 <= column <= WINDOW_CELLS and 1 <= row <= WINDOW_CELLS):
            break
        last = row * WINDOW_SIZE + column
        if low <= column <= high and low <= row <= high and steps[last] != 0:
            steps[last] = 0
            queue[size] = last
            size += 1
    _spread(steps, queue, size, -1, 0)
    if last >= 0:
        steps = goal.reshape(goal.size)
        steps[last] = 0
        queue[0] = last
        _spread(steps, queue, 1, middle * WINDOW_SIZE + middle, 2 * box + _DETOUR_CELLS)


@compiled_in_place
def _open_cells(costs: Float32Array, distances: ByteArray, steps: UInt16Array) -> None:
    """Prepare a search: bar cells of inscribed cost or more, and the window's border."""
    # Costs fall with the distance, so one comparison tells; unlike a look-up it runs in lanes.
    barred = 0
    while costs[barred] >= INSCRIBED:
        barred += 1
    nearest = np.uint8(barred)
    for row in range(WINDOW_SIZE):
        for column in range(WINDOW_SIZE):
            steps[row, column] = UNREACHED if distances[row, column] >= nearest else BLOCKED
    steps[0, :] = BLOCKED
    steps[WINDOW_SIZE - 1, :] = BLOCKED
    steps[:, 0] = BLOCKED
    steps[:, WINDOW_SIZE - 1] = BLOCKED


@compiled_in_place
def _open_footprint(slot: Slot, steps: UInt16Array, robot: RobotModel) -> None:
    """Let the search pass where the robot stands (`within_robot`)."""
    cosine, sine = math.cos(slot.yaw), math.sin(slot.yaw)
    centre_x, centre_y = window_place(slot, slot.x, slot.y)
    reach = int(robot.circumscribed_radius / RESOLUTION_M) + 1
    for row in range(int(centre_y) - reach, int(centre_y) + reach + 1):
        for column in range(int(centre_x) - reach, int(centre_x) + reach + 1):
            away_x = (column + 0.5 - centre_x) * RESOLUTION_M
            away_y = (row + 0.5 - centre_y) * RESOLUTION_M
            if is_inside(
                robot.footprint_sides,
                cosine * away_x + sine * away_y,
                cosine * away_y - sine * away_x,
            ):
                steps[row, column] = UNREACHED


@compiled_in_place
def _spread(steps: UInt16Array, queue: Int32Array, size: int, robot: int, beyond: int) -> None:
    """Search breadth first from the queued cells; `steps` is flat, with a blocked border.

    The search ends so many steps `beyond` the cell `robot`, or never where that is -1.
    """
    first, step = 0, np.uint16(0)
    while first < size:
        step = np.uint16(step + 1)
        if robot >= 0 and steps[robot] < BLOCKED and step > steps[robot] + beyond:
            return
        last = size
        for k in range(first, last):
            # Unsigned indices spare numba's test for negative ones in this busiest of loops.
            cell = np.uint64(queue[np.uint64(k)])
            for neighbour in (cell - _ONE, cell + _ONE, cell - _ROW, cell + _ROW):
                if steps[neighbour] == UNREACHED:
                    steps[neighbour] = step
                    queue[np.uint64(size)] = np.int32(neighbour)
                    size += 1
        first = last
