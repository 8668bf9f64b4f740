"""One control tick of one slot, in three kernels: plan, move, sense; and loops over slots.

Sensing closes a tick, so that whoever looks after whole ticks sees the newest scan.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ses_core.arrays import BoolArray, FloatArray
from ses_core.compilation import compiled
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.planning.costmap import (
    centre_window,
    inflation_costs,
    refresh_distances,
    work_in_scan,
)
from ses_core.planning.distance_maps import measure_distances
from ses_core.planning.global_planner import update_plan
from ses_core.planning.recovery import recover
from ses_core.planning.rollouts import SIM_TIME_S
from ses_core.planning.trajectory_planner import (
    ESCAPE_REACH_M,
    HEADING_LOOKAHEAD_M,
    MIN_VEL_X,
    find_command,
)
from ses_core.settings import SimulationSettings
from ses_core.simulation.lidar import cast_scan
from ses_core.simulation.noise import draw_normal, draw_uniform
from ses_core.simulation.robot import RobotModel, approach, drive, touches, wrap
from ses_core.simulation.state import Memory, Scratch, Slot

_RUNNING = int(EpisodeOutcome.RUNNING)
_SUCCESS = int(EpisodeOutcome.SUCCESS)
_COLLISION = int(EpisodeOutcome.COLLISION)
_TIMEOUT = int(EpisodeOutcome.TIMEOUT)
_STUCK = int(EpisodeOutcome.STUCK)

_MAX_VEL_X, _INFLATION_RADIUS = 0, 6  # places among the parameters
_MOTION_STEP_M = 0.02  # the body is tested for contact at least this often on its way
_PLAN_AGE_S = 2.0  # the global planner's potential is computed anew after this at the latest


SENSE, PLAN, SETTLE, ADVANCE = range(4)
"""Phases of `run_share`: sense in chosen slots; plan one tick; end a tick by somebody else's
motion; whole ticks."""


class Outside(NamedTuple):
    """What passes between the kernel and somebody else's physics; empty for whole ticks."""

    commands: FloatArray  # (N, 2) what reaches the wheels
    poses: FloatArray  # (N, 3)
    velocities: FloatArray  # (N, 2)
    chosen: BoolArray  # (N,) slots to sense in, or those in contact


class Conditions(NamedTuple):
    """`SimulationSettings` as the kernels need them: durations in ticks."""

    period: float  # [s]
    sense_every: int
    plan_age: int
    range_noise: float
    range_dropout: float
    actuation_noise: float
    time_limit: int
    success_radius: float
    collisions_end: bool
    stuck_distance: float
    stuck_time: int
    clears_footprint: bool


def conditions(settings: SimulationSettings) -> Conditions:
    """Prepare the settings for compiled code."""
    rate = settings.control_rate_hz
    return Conditions(
        period=1.0 / rate,
        sense_every=max(1, round(rate / settings.sensing_rate_hz)),
        plan_age=round(_PLAN_AGE_S * rate),
        range_noise=settings.range_noise_m,
        range_dropout=settings.range_dropout,
        actuation_noise=settings.actuation_noise,
        time_limit=round(settings.time_limit_s * rate),
        success_radius=settings.success_radius_m,
        collisions_end=settings.collisions_end,
        stuck_distance=settings.stuck_distance_m,
        stuck_time=round(settings.stuck_time_s * rate),
        clears_footprint=settings.footprint_clearing,
    )


@compiled
def sense(
    slot: Slot,
    memory: Memory,
    number: int,
    robot: RobotModel,
    setup: Conditions,
    scratch: Scratch,
    worker: int,
) -> None:
    """Take a scan, work it into the map, and bring plan and local maps up to date."""
    ranges = memory.scans[number]
    cosine, sine = math.cos(slot.yaw), math.sin(slot.yaw)
    cast_scan(
        ranges,
        memory.clearance,
        slot.world_offset,
        slot.world_width,
        slot.world_height,
        slot.world_resolution,
        slot.x + cosine * robot.mount_x - sine * robot.mount_y - slot.world_x,
        slot.y + sine * robot.mount_x + cosine * robot.mount_y - slot.world_y,
        slot.yaw + robot.mount_yaw,
        robot.beams,
        robot.range_min,
        robot.range_max,
    )
    if setup.range_noise > 0.0:
        for beam in range(ranges.shape[0]):
            noisy = ranges[beam] + setup.range_noise * draw_normal(slot)
            ranges[beam] = max(noisy, robot.range_min)
    if setup.range_dropout > 0.0:
        for beam in range(ranges.shape[0]):
            if draw_uniform(slot) < setup.range_dropout:
                ranges[beam] = np.inf
    work_in_scan(
        slot, memory, ranges, robot, scratch.queue[worker], clears_footprint=setup.clears_footprint
    )
    refresh_distances(slot, memory, scratch, worker)
    update_plan(slot, memory, number, scratch, worker, setup.plan_age)
    centre_window(slot, memory, number)
    measure_distances(slot, memory, number, robot, scratch, worker)


@compiled
def plan(
    slot: Slot,
    memory: Memory,
    number: int,
    robot: RobotModel,
    setup: Conditions,
    parameters: FloatArray,
    scratch: Scratch,
    worker: int,
) -> None:
    """Set the slot's command for this tick and send it on its way to the wheels."""
    has_news = parameters[_INFLATION_RADIUS] != slot.inflation_radius
    if has_news:
        slot.inflation_radius = parameters[_INFLATION_RADIUS]
        inflation_costs(memory.costs[number], slot.inflation_radius, robot.inscribed_radius)
        slot.search_needed = True
        update_plan(slot, memory, number, scratch, worker, setup.plan_age)
    farthest = max(parameters[_MAX_VEL_X], MIN_VEL_X) * (
        SIM_TIME_S + setup.sense_every * setup.period
    )
    # In front of the robot there is also the place where turning in place looks ahead.
    reach = max(farthest, ESCAPE_REACH_M) + HEADING_LOOKAHEAD_M
    if has_news or reach != slot.rollout_reach:
        slot.rollout_reach = reach
        measure_distances(slot, memory, number, robot, scratch, worker)
    if not recover(slot, memory, number, robot, setup.period):
        is_valid = slot.has_plan and find_command(
            slot, memory, number, robot, parameters, setup.period, scratch, worker
        )
        if is_valid:
            slot.control_tick = slot.tick
        else:
            slot.command_v, slot.command_w = 0.0, 0.0
    delayed = memory.delayed[number]
    delayed[slot.tick % delayed.shape[0], 0] = slot.command_v
    delayed[slot.tick % delayed.shape[0], 1] = slot.command_w


@compiled
def wheel_command(slot: Slot, memory: Memory, number: int) -> tuple[float, float]:
    """Give the command that reaches the wheels in this tick: the oldest still under way."""
    delayed = memory.delayed[number]
    oldest = (slot.tick + 1) % delayed.shape[0]
    return delayed[oldest, 0], delayed[oldest, 1]


@compiled
def move(slot: Slot, memory: Memory, number: int, robot: RobotModel, setup: Conditions) -> None:
    """Drive for one period; contact stops the body where it last was free."""
    command_v, command_w = wheel_command(slot, memory, number)
    v = approach(
        slot.v,
        min(max(command_v, -robot.max_speed), robot.max_speed),
        robot.acceleration * setup.period,
    )
    w = approach(
        slot.w,
        min(max(command_w, -robot.max_turn_rate), robot.max_turn_rate),
        robot.turn_acceleration * setup.period,
    )
    half = 0.5 * robot.track
    left = (v - half * w) * (1.0 + setup.actuation_noise * draw_normal(slot))
    right = (v + half * w) * (1.0 + setup.actuation_noise * draw_normal(slot))
    v, w = 0.5 * (left + right), (right - left) / robot.track
    pieces = max(
        1,
        math.ceil((abs(v) + abs(w) * robot.body_radius) * setup.period / _MOTION_STEP_M),
    )
    x, y, yaw = slot.x, slot.y, slot.yaw
    has_contact = False
    for _ in range(pieces):
        next_x, next_y, next_yaw = drive(x, y, yaw, v, w, setup.period / pieces)
        if touches(
            robot,
            next_x - slot.world_x,
            next_y - slot.world_y,
            next_yaw,
            memory.clearance,
            slot.world_offset,
            slot.world_width,
            slot.world_height,
            slot.world_resolution,
        ):
            has_contact = True
            v, w = 0.0, 0.0
            break
        x, y, yaw = next_x, next_y, next_yaw
    settle(slot, setup, x, y, yaw, v, w, has_contact)


@compiled
def settle(
    slot: Slot,
    setup: Conditions,
    x: float,
    y: float,
    yaw: float,
    v: float,
    w: float,
    has_contact: bool,
) -> None:
    """Record where a tick has brought the robot, and whether that ends the episode."""
    slot.path_length += math.hypot(x - slot.x, y - slot.y)
    slot.x, slot.y, slot.yaw = x, y, wrap(yaw)
    slot.v, slot.w = v, w
    slot.tick += 1
    if slot.command_v < 0.0:
        slot.negative_count += 1
    if math.hypot(x - slot.anchor_x, y - slot.anchor_y) >= setup.stuck_distance:
        slot.anchor_x, slot.anchor_y, slot.anchor_tick = x, y, slot.tick
    if has_contact:
        slot.contact_count += 1
    if has_contact and setup.collisions_end:
        slot.outcome = _COLLISION
    elif math.hypot(x - slot.goal_x, y - slot.goal_y) <= setup.success_radius:
        slot.outcome = _SUCCESS
    elif slot.tick >= setup.time_limit:
        slot.outcome = _TIMEOUT
    elif slot.tick - slot.anchor_tick >= setup.stuck_time:
        slot.outcome = _STUCK


@compiled
def run_share(
    phase: int,
    worker: int,
    workers: int,
    slots: NDArray[np.void],
    memory: Memory,
    robot: RobotModel,
    setup: Conditions,
    scratch: Scratch,
    parameters: FloatArray,
    ticks: int,
    outside: Outside,
) -> None:
    """Run one phase in every `workers`-th slot from the `worker`-th on.

    A slot runs all its ticks before the next begins, so that its maps stay in the cache. One
    kernel for all phases, because each kernel that numba builds optimises all it calls again.
    """
    for number in range(worker, slots.shape[0], workers):
        slot = slots[number]
        is_due = phase == SENSE and outside.chosen[number]
        rounds = 1 if is_due else 0
        if phase != SENSE and slot.outcome == _RUNNING:
            rounds = ticks
        for _ in range(rounds):
            if phase in (PLAN, ADVANCE):
                plan(slot, memory, number, robot, setup, parameters[number], scratch, worker)
            if phase == PLAN:
                v, w = wheel_command(slot, memory, number)
                outside.commands[number, 0], outside.commands[number, 1] = v, w
            if phase == ADVANCE:
                move(slot, memory, number, robot, setup)
            if phase == SETTLE:
                _take_over(slot, setup, outside, number)
            if phase in (ADVANCE, SETTLE):
                is_due = slot.tick % setup.sense_every == 0
            if is_due:
                sense(slot, memory, number, robot, setup, scratch, worker)
            if slot.outcome != _RUNNING:
                break


@compiled
def _take_over(slot: Slot, setup: Conditions, outside: Outside, number: int) -> None:
    """Record a motion that somebody else computed."""
    x, y, yaw = outside.poses[number, 0], outside.poses[number, 1], outside.poses[number, 2]
    v, w = outside.velocities[number, 0], outside.velocities[number, 1]
    settle(slot, setup, x, y, yaw, v, w, outside.chosen[number])
