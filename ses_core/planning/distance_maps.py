"""Cells to the plan and to the local goal (base_local_planner's `MapGrid`): what samples cost."""

import math

import numpy as np

from ses_core.compilation import compiled
from ses_core.planning.costmap import (
    INSCRIBED,
    RESOLUTION_M,
    WINDOW_SIZE,
    is_inside,
    window_place,
)
from ses_core.simulation.robot import RobotModel
from ses_core.simulation.state import Int32Array, Memory, Scratch, Slot, UInt16Array

UNREACHED = np.uint16(65535)
BLOCKED = np.uint16(65534)
IMPOSSIBLE = 65534
"""From this value on, no way leads there."""


@compiled
def measure_distances(
    slot: Slot, memory: Memory, number: int, robot: RobotModel, scratch: Scratch, worker: int
) -> None:
    """Count the steps (4 neighbours) from every window cell to the plan and to its last point.

    Cells with inscribed cost block the way, except under the robot itself. The plan counts up to
    where it leaves the window; its last point there is the local goal.
    """
    path, goal = memory.path_steps[number], memory.goal_steps[number]
    costs, distances = memory.costs[number], memory.window_distances[number]
    for row in range(WINDOW_SIZE):
        for column in range(WINDOW_SIZE):
            is_blocked = costs[distances[row, column]] >= INSCRIBED
            path[row, column] = BLOCKED if is_blocked else UNREACHED
    _open_footprint(slot, path, robot)
    path[0, :], path[WINDOW_SIZE - 1, :] = BLOCKED, BLOCKED
    path[:, 0], path[:, WINDOW_SIZE - 1] = BLOCKED, BLOCKED
    goal[:] = path
    queue = scratch.queue[worker]
    plan = memory.plans[number]
    size = 0
    last = -1
    steps = path.ravel()
    for k in range(slot.plan_size):
        column = int(plan[k, 0]) - slot.window_column + 1
        row = int(plan[k, 1]) - slot.window_row + 1
        if not (1 <= column < WINDOW_SIZE - 1 and 1 <= row < WINDOW_SIZE - 1):
            break
        last = row * WINDOW_SIZE + column
        if steps[last] != 0:
            steps[last] = 0
            queue[size] = last
            size += 1
    _spread(steps, queue, size)
    if last >= 0:
        steps = goal.ravel()
        steps[last] = 0
        queue[0] = last
        _spread(steps, queue, 1)


@compiled
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


@compiled
def _spread(steps: UInt16Array, queue: Int32Array, size: int) -> None:
    """Search breadth first from the queued cells; `steps` is flat, with a blocked border."""
    head = 0
    while head < size:
        cell = queue[head]
        head += 1
        following = steps[cell] + np.uint16(1)
        for neighbour in (cell - 1, cell + 1, cell - WINDOW_SIZE, cell + WINDOW_SIZE):
            if steps[neighbour] == UNREACHED:
                steps[neighbour] = following
                queue[size] = neighbour
                size += 1
