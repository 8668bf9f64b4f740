"""Control ticks of slots: sense, plan, move, and the loop over slots that threads share.

Sensing closes a tick, so that whoever looks after whole ticks sees the newest scan.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ses_core.arrays import BoolArray, FloatArray
from ses_core.compilation import compiled, compiled_in_place
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.planning.costmap import inflation_costs
from ses_core.planning.distance_maps import measure_distances
from ses_core.planning.global_planner import SEARCH_EVERY, update_plan
from ses_core.planning.recovery import recover
from ses_core.planning.rollouts import SIM_TIME_S
from ses_core.planning.trajectory_planner import find_command
from ses_core.simulation.conditions import Conditions
from ses_core.simulation.motion import move, remember_pose, settle, wheel_command
from ses_core.simulation.robot import RobotModel
from ses_core.simulation.sensing import sense
from ses_core.simulation.state import Memory, Scratch, Slot
from ses_core.simulation.trace import Trace

_RUNNING = int(EpisodeOutcome.RUNNING)

_MAX_VEL_X, _INFLATION_RADIUS = 0, 6  # places among the parameters

SENSE, PLAN, SETTLE, ADVANCE = range(4)
"""Phases of `run_share`: sense in chosen slots; plan one tick; end a tick by somebody else's
motion; whole ticks."""


class Outside(NamedTuple):
    """What passes between the kernel and somebody else's physics; empty for whole ticks."""

    commands: FloatArray  # (N, 2) what reaches the wheels
    poses: FloatArray  # (N, 3)
    velocities: FloatArray  # (N, 2)
    chosen: BoolArray  # (N,) slots to sense in, or those in contact


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
        slot.search_needed, slot.search_tick = True, slot.tick - SEARCH_EVERY
        update_plan(slot, memory, number, scratch, worker, setup.plan_age)
    farthest = max(parameters[_MAX_VEL_X], robot.min_vel_x) * (
        SIM_TIME_S + setup.sense_every * setup.period
    )
    # In front of the robot there is also the place where turning in place looks ahead.
    reach = max(farthest, -robot.escape_vel * SIM_TIME_S) + robot.heading_lookahead
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
    trace: Trace,
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
                v, w = wheel_command(slot, memory, number, robot, setup)
                outside.commands[number, 0], outside.commands[number, 1] = v, w
            if phase == ADVANCE:
                move(slot, memory, number, robot, setup)
            if phase == SETTLE:
                _take_over(slot, memory, setup, outside, number)
            if phase in (ADVANCE, SETTLE):
                is_due = slot.tick % setup.sense_every == 0
            if phase == SENSE and is_due:
                remember_pose(slot, memory, number)
            if is_due:
                sense(slot, memory, number, robot, setup, scratch, worker)
            if phase != PLAN:
                _note_tick(trace, slot, memory, number, setup.sense_every, is_due)
            if slot.outcome != _RUNNING:
                break


@compiled
def _take_over(
    slot: Slot, memory: Memory, setup: Conditions, outside: Outside, number: int
) -> None:
    """Record a motion that somebody else computed."""
    x, y, yaw = outside.poses[number, 0], outside.poses[number, 1], outside.poses[number, 2]
    v, w = outside.velocities[number, 0], outside.velocities[number, 1]
    settle(slot, memory, number, setup, x, y, yaw, v, w, outside.chosen[number])


@compiled_in_place
def _note_tick(
    trace: Trace, slot: Slot, memory: Memory, number: int, sense_every: int, has_sensed: bool
) -> None:
    """Write down the tick that a slot has just ended, and the scan that arrived with it."""
    row = slot.tick
    if number >= trace.poses.shape[0] or row >= trace.poses.shape[1]:
        return
    trace.poses[number, row, 0] = slot.true_x
    trace.poses[number, row, 1] = slot.true_y
    trace.poses[number, row, 2] = slot.true_yaw
    trace.odometry[number, row, 0] = slot.x
    trace.odometry[number, row, 1] = slot.y
    trace.odometry[number, row, 2] = slot.yaw
    trace.velocities[number, row, 0], trace.velocities[number, row, 1] = slot.v, slot.w
    trace.commands[number, row, 0] = slot.command_v
    trace.commands[number, row, 1] = slot.command_w
    if has_sensed:
        for beam in range(trace.scans.shape[2]):
            trace.scans[number, row // sense_every, beam] = memory.scans[number, beam]
