"""The local planner: base_local_planner's TrajectoryPlanner with `dwa: true`, in compiled code.

Same as the original: velocity window, order of samples, costs and their scaling, preference for
turning in place, oscillation flags, and the escape that is the stack's only negative velocity.

Simplified, and why:
- A sample moves at its velocity for the whole roll-out. The original lets it approach by the
  acceleration limits, which inside a dynamic window takes one of its steps.
- Roll-outs step 0.05 m of the farthest body point (the original 0.02 m or 0.02 rad) and test
  points of the padded outline 0.165 m apart (the original each cell on it); coarser lets
  contacts happen that the stack avoids, finer changes nothing. A pose within
  the footprint's reach of the local costmap's rim counts as off the map.
- Samples are tried in the order of their cost at the end point, and given up once their cost is
  known to exceed the best. That decides how soon the best is found, not which one it is.
"""

import math

from ses_core.arrays import FloatArray
from ses_core.compilation import compiled_in_place
from ses_core.planning.costmap import RESOLUTION_M, WINDOW_SIZE, window_place
from ses_core.planning.distance_maps import IMPOSSIBLE
from ses_core.planning.rollouts import NO_WAY, SIM_TIME_S, rollout_cost
from ses_core.simulation.robot import RobotModel, drive, wrap
from ses_core.simulation.state import Memory, Scratch, Slot, UInt16Array

MAX_VX_SAMPLES = 24
MAX_VTHETA_SAMPLES = 64

_MAX_VEL_X, _MAX_VEL_THETA, _VX_SAMPLES, _VTHETA_SAMPLES, _PATH_BIAS, _GOAL_BIAS = range(6)
_OCCDIST_SCALE = 7


@compiled_in_place
def velocity_window(
    velocity: float, lowest: float, highest: float, acceleration: float, period: float
) -> tuple[float, float]:
    """Give what is reachable within one control period, inside the limits."""
    return (
        max(lowest, velocity - acceleration * period),
        max(min(highest, velocity + acceleration * period), lowest),
    )


@compiled_in_place
def find_command(
    slot: Slot,
    memory: Memory,
    number: int,
    robot: RobotModel,
    parameters: FloatArray,
    period: float,
    scratch: Scratch,
    worker: int,
) -> bool:
    """Set the slot's command to the best sample's velocities.

    The parameters (8,) are in the order of `PARAMETER_NAMES`, the period in s.

    Returns:
        Whether there is a valid command; without one the robot stops.
    """
    vx_count = min(max(int(parameters[_VX_SAMPLES] + 0.5), 2), MAX_VX_SAMPLES)
    vtheta_count = min(max(int(parameters[_VTHETA_SAMPLES] + 0.5), 2), MAX_VTHETA_SAMPLES)
    last = slot.plan_size - 1
    away_x = slot.map_x + memory.plans[number, last, 0] * RESOLUTION_M - slot.x
    away_y = slot.map_y + memory.plans[number, last, 1] * RESOLUTION_M - slot.y
    highest = min(
        min(parameters[_MAX_VEL_X], robot.max_speed), math.hypot(away_x, away_y) / SIM_TIME_S
    )
    v_low, v_high = velocity_window(slot.v, robot.min_vel_x, highest, robot.acceleration, period)
    turn = min(parameters[_MAX_VEL_THETA], robot.max_turn_rate)
    w_low, w_high = velocity_window(slot.w, -turn, turn, robot.turn_acceleration, period)
    w_step = (w_high - w_low) / (vtheta_count - 1)
    best_cost, best_v, best_w = -1.0, 0.0, 0.0
    if not slot.is_escaping:
        sample, best_cost = _best_forward(
            slot,
            memory,
            number,
            robot,
            parameters,
            scratch.samples[worker],
            v_low,
            v_high,
            vx_count,
            w_low,
            w_step,
            vtheta_count,
        )
        if sample >= 0:
            best_v = v_low + (sample // vtheta_count) * (v_high - v_low) / (vx_count - 1)
            best_w = _forward_turn(sample % vtheta_count, w_low, w_step)
    best_cost, best_v, best_w = _prefer_turning(
        slot,
        memory,
        number,
        robot,
        parameters,
        w_low,
        w_step,
        vtheta_count,
        best_cost,
        best_v,
        best_w,
    )
    if best_cost >= 0.0:
        _note_oscillation(slot, robot, best_v, best_w)
        _end_escape(slot, robot)
        slot.command_v, slot.command_w = best_v, best_w
        return True
    return _escape(slot, memory, number, robot)


@compiled_in_place
def _forward_turn(place: int, w_low: float, w_step: float) -> float:
    """Give the turn rate of a forward sample: straight first, then from the window's low end."""
    return 0.0 if place == 0 else w_low + (place - 1) * w_step


@compiled_in_place
def _obstacle_weight(robot: RobotModel, parameters: FloatArray) -> float:
    """Give the weight of obstacle costs: the parameter, or below 0 the robot's own."""
    weight = parameters[_OCCDIST_SCALE]
    return weight if weight >= 0.0 else robot.occdist_scale


@compiled_in_place
def _best_forward(
    slot: Slot,
    memory: Memory,
    number: int,
    robot: RobotModel,
    parameters: FloatArray,
    samples: FloatArray,
    v_low: float,
    v_high: float,
    vx_count: int,
    w_low: float,
    w_step: float,
    vtheta_count: int,
) -> tuple[int, float]:
    """Find the cheapest legal forward sample, the first of equals; (-1, -1) if none is legal."""
    x, y = window_place(slot, slot.x, slot.y)
    path, goal = memory.path_steps[number], memory.goal_steps[number]
    weight = _obstacle_weight(robot, parameters)
    v_step = (v_high - v_low) / (vx_count - 1)
    count = vx_count * vtheta_count
    for place in range(vtheta_count):
        w = _forward_turn(place, w_low, w_step)
        unit_x, unit_y, _ = drive(0.0, 0.0, slot.yaw, 1.0 / RESOLUTION_M, w, SIM_TIME_S)
        for level in range(vx_count):
            v = v_low + level * v_step
            samples[level * vtheta_count + place] = _end_cost(
                path, goal, x + v * unit_x, y + v * unit_y, parameters
            )
    best, best_cost = -1, -1.0
    while True:
        sample = 0
        for other in range(1, count):
            if samples[other] < samples[sample]:
                sample = other
        end_cost = samples[sample]
        if end_cost == math.inf or (best >= 0 and end_cost > best_cost):
            return best, best_cost
        samples[sample] = math.inf
        v = v_low + (sample // vtheta_count) * v_step
        w = _forward_turn(sample % vtheta_count, w_low, w_step)
        allowed = math.inf if best < 0 else (best_cost - end_cost) / weight
        cost = rollout_cost(slot, memory, number, robot, v, w, True, allowed)
        if cost < 0.0:
            continue
        cost = end_cost + weight * cost
        if best < 0 or cost < best_cost or (cost == best_cost and sample < best):
            best, best_cost = sample, cost


@compiled_in_place
def _end_cost(
    path: UInt16Array, goal: UInt16Array, x: float, y: float, parameters: FloatArray
) -> float:
    """Give what ending at (x, y) [cells] costs by path and goal; inf where a sample must not."""
    if not (1.0 <= x < WINDOW_SIZE - 1.0 and 1.0 <= y < WINDOW_SIZE - 1.0):
        return math.inf
    column, row = int(x), int(y)
    to_path, to_goal = int(path[row, column]), int(goal[row, column])
    if to_path >= IMPOSSIBLE or to_goal >= IMPOSSIBLE:
        return math.inf
    return RESOLUTION_M * (parameters[_PATH_BIAS] * to_path + parameters[_GOAL_BIAS] * to_goal)


@compiled_in_place
def _prefer_turning(
    slot: Slot,
    memory: Memory,
    number: int,
    robot: RobotModel,
    parameters: FloatArray,
    w_low: float,
    w_step: float,
    vtheta_count: int,
    best_cost: float,
    best_v: float,
    best_w: float,
) -> tuple[float, float, float]:
    """Turn in place instead, if that costs no more, towards where the goal is nearest ahead."""
    x, y = window_place(slot, slot.x, slot.y)
    path, goal = memory.path_steps[number], memory.goal_steps[number]
    end_cost = _end_cost(path, goal, x, y, parameters)
    if end_cost == math.inf:
        return best_cost, best_v, best_w
    weight = _obstacle_weight(robot, parameters)
    least_ahead = math.inf
    for k in range(vtheta_count):
        sampled = w_low + k * w_step
        if abs(sampled) <= w_step or (slot.is_stuck_left if sampled < 0.0 else slot.is_stuck_right):
            continue
        w = (
            max(sampled, robot.min_in_place_vel_theta)
            if sampled > 0.0
            else min(sampled, -robot.min_in_place_vel_theta)
        )
        yaw = slot.yaw + w * SIM_TIME_S
        ahead_x = x + robot.heading_lookahead / RESOLUTION_M * math.cos(yaw)
        ahead_y = y + robot.heading_lookahead / RESOLUTION_M * math.sin(yaw)
        ahead = float(goal[int(ahead_y), int(ahead_x)])
        if ahead >= least_ahead:
            continue
        cost = rollout_cost(slot, memory, number, robot, 0.0, w, True, math.inf)
        if cost < 0.0:
            continue
        cost = end_cost + weight * cost
        if best_cost < 0.0 or cost <= best_cost:
            best_cost, best_v, best_w, least_ahead = cost, 0.0, w, ahead
    return best_cost, best_v, best_w


@compiled_in_place
def _note_oscillation(slot: Slot, robot: RobotModel, v: float, w: float) -> None:
    """Bar turning back after turning twice one way, until the robot has moved on.

    The names are the original's: after two turns to the right `stuck_right` bars turns to the
    left.
    """
    if v <= 0.0:
        if w < 0.0:
            slot.is_stuck_right = slot.is_stuck_right or slot.is_rotating_right
            slot.is_rotating_right = True
        elif w > 0.0:
            slot.is_stuck_left = slot.is_stuck_left or slot.is_rotating_left
            slot.is_rotating_left = True
        slot.oscillation_x, slot.oscillation_y = slot.x, slot.y
    _reset_oscillation(slot, robot)


@compiled_in_place
def _reset_oscillation(slot: Slot, robot: RobotModel) -> None:
    moved = math.hypot(slot.x - slot.oscillation_x, slot.y - slot.oscillation_y)
    if moved > robot.oscillation_reset_dist:
        slot.is_rotating_left, slot.is_rotating_right = False, False
        slot.is_stuck_left, slot.is_stuck_right = False, False


@compiled_in_place
def _end_escape(slot: Slot, robot: RobotModel) -> None:
    """Allow forward samples again once the robot got away."""
    moved = math.hypot(slot.x - slot.escape_x, slot.y - slot.escape_y)
    if (
        moved > robot.escape_reset_dist
        or abs(wrap(slot.yaw - slot.escape_yaw)) > robot.escape_reset_theta
    ):
        slot.is_escaping = False


@compiled_in_place
def _escape(slot: Slot, memory: Memory, number: int, robot: RobotModel) -> bool:
    """Back up, even where the map shows an obstacle; not where no way leads from."""
    cost = rollout_cost(slot, memory, number, robot, robot.escape_vel, 0.0, False, math.inf)
    _reset_oscillation(slot, robot)
    if not slot.is_escaping and cost > NO_WAY:
        slot.escape_x, slot.escape_y, slot.escape_yaw = slot.x, slot.y, slot.yaw
        slot.is_escaping = True
    _end_escape(slot, robot)
    if cost == NO_WAY:
        slot.command_v, slot.command_w = 0.0, 0.0
        return False
    slot.command_v, slot.command_w = robot.escape_vel, 0.0
    return True
