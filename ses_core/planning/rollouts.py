"""Roll-outs: what it costs to keep a velocity for two seconds."""

import math

from ses_core.arrays import ByteArray, Float32Array
from ses_core.compilation import compiled_in_place
from ses_core.planning.costmap import (
    RESOLUTION_M,
    WINDOW_SIZE,
    inflation_cells,
    window_place,
)
from ses_core.planning.distance_maps import IMPOSSIBLE
from ses_core.simulation.robot import RobotModel
from ses_core.simulation.state import Memory, Slot

SIM_TIME_S = 2.0
"""How far ahead a roll-out looks [s] (sim_time)."""

ROLLOUT_STEP_M = 0.05
"""Largest step [m] of the body point that moves most."""

HITS = -1.0
NO_WAY = -2.0
"""Costs of a roll-out whose outline meets a lethal cell; that enters a cell no way leads from."""


@compiled_in_place
def rollout_cost(
    slot: Slot,
    memory: Memory,
    number: int,
    robot: RobotModel,
    v: float,
    w: float,
    is_backwards: bool,
    allowed: float,
) -> float:
    """Give the highest cost under the outline and the centre over a roll-out of 2 s.

    Backwards, from its end to its start, gives the same cost and meets a collision sooner; in
    the order of driving the first reason decides between HITS and NO_WAY. It stops once the
    cost exceeds what is `allowed`.

    Returns:
        A cost in [0, 253], HITS or NO_WAY.
    """
    distances, costs = memory.window_distances[number], memory.costs[number]
    path, goal = memory.path_steps[number], memory.goal_steps[number]
    centre_x, centre_y = window_place(slot, slot.x, slot.y)
    farthest = max(abs(v), abs(w) * robot.circumscribed_radius) * SIM_TIME_S
    steps = max(1, math.ceil(farthest / ROLLOUT_STEP_M))
    first_cosine, first_sine = math.cos(slot.yaw), math.sin(slot.yaw)
    turned = w * SIM_TIME_S / steps
    cosine, sine = first_cosine, first_sine
    if is_backwards:
        cosine = math.cos(slot.yaw + w * SIM_TIME_S)
        sine = math.sin(slot.yaw + w * SIM_TIME_S)
        turned = -turned
    turn_cosine, turn_sine = math.cos(turned), math.sin(turned)
    is_straight = abs(w) < 1e-6
    radius = 0.0 if is_straight else v / w / RESOLUTION_M
    stride = v * SIM_TIME_S / steps / RESOLUTION_M
    harmless = _harmless_distance(slot, robot)
    worst = 0.0
    for k in range(steps + 1):
        step = steps - k if is_backwards else k
        if is_straight:
            x, y = centre_x + step * stride * cosine, centre_y + step * stride * sine
        else:
            x = centre_x + radius * (sine - first_sine)
            y = centre_y - radius * (cosine - first_cosine)
        cost = _pose_cost(distances, costs, robot, x, y, cosine, sine, harmless)
        if cost < 0.0:
            return HITS
        if path[int(y), int(x)] >= IMPOSSIBLE or goal[int(y), int(x)] >= IMPOSSIBLE:
            return NO_WAY
        worst = max(worst, cost)
        if worst > allowed:
            return worst
        cosine, sine = (
            cosine * turn_cosine - sine * turn_sine,
            sine * turn_cosine + cosine * turn_sine,
        )
    return worst


@compiled_in_place
def _harmless_distance(slot: Slot, robot: RobotModel) -> int:
    """Give the squared distance [cells^2] of the centre from which no outline cell has a cost."""
    reach = inflation_cells(slot.inflation_radius) + robot.circumscribed_radius / RESOLUTION_M
    # Both the centre and the outline point may lie anywhere in their cells.
    return math.ceil((reach + math.sqrt(2.0)) ** 2)


@compiled_in_place
def _pose_cost(
    distances: ByteArray,
    costs: Float32Array,
    robot: RobotModel,
    x: float,
    y: float,
    cosine: float,
    sine: float,
    harmless: int,
) -> float:
    """Give the highest cost under the outline and the centre at a pose [cells], or HITS."""
    rim = robot.circumscribed_radius / RESOLUTION_M + 1.0
    if not (rim <= x < WINDOW_SIZE - rim and rim <= y < WINDOW_SIZE - rim):
        return HITS
    least = int(distances[int(y), int(x)])
    if least >= harmless:
        return 0.0
    cosine, sine = cosine / RESOLUTION_M, sine / RESOLUTION_M
    for k in range(robot.outline.shape[0]):
        point_x = x + cosine * robot.outline[k, 0] - sine * robot.outline[k, 1]
        point_y = y + sine * robot.outline[k, 0] + cosine * robot.outline[k, 1]
        squared = int(distances[int(point_y), int(point_x)])
        if squared == 0:
            return HITS
        least = min(least, squared)
    return float(costs[least])
