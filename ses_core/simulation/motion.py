"""How a slot moves: late and noisy commands, true motion, and the motion that is believed."""

import math

from ses_core.compilation import compiled
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.simulation.conditions import Conditions
from ses_core.simulation.noise import draw_normal
from ses_core.simulation.robot import RobotModel, approach, drive, touches, wrap
from ses_core.simulation.state import Memory, Slot

_SUCCESS = int(EpisodeOutcome.SUCCESS)
_COLLISION = int(EpisodeOutcome.COLLISION)
_TIMEOUT = int(EpisodeOutcome.TIMEOUT)
_STUCK = int(EpisodeOutcome.STUCK)

NOT_FORWARD_SPEED_MPS = 0.05
"""At or below this command a tick counts as not moving forward: `ExtractionSettings`' default."""

_MOTION_STEP_M = 0.02  # the body is tested for contact at least this often on its way


@compiled
def wheel_command(
    slot: Slot, memory: Memory, number: int, robot: RobotModel, setup: Conditions
) -> tuple[float, float]:
    """Give what the wheels are driven at in this tick: the oldest command under way, spoilt.

    Each side's speed is noisy; how far the skidding wheels turn the robot is the episode's own.
    """
    delayed = memory.delayed[number]
    oldest = (slot.tick + 1) % delayed.shape[0]
    v = min(max(delayed[oldest, 0], -robot.max_speed), robot.max_speed)
    w = min(max(delayed[oldest, 1], -robot.max_turn_rate), robot.max_turn_rate)
    half = 0.5 * robot.track
    left = (v - half * w) * (1.0 + setup.wheel_noise * draw_normal(slot))
    right = (v + half * w) * (1.0 + setup.wheel_noise * draw_normal(slot))
    return 0.5 * (left + right), slot.turn_gain * (right - left) / robot.track


@compiled
def move(slot: Slot, memory: Memory, number: int, robot: RobotModel, setup: Conditions) -> None:
    """Drive for one period; contact stops the body where it last was free."""
    wanted_v, wanted_w = wheel_command(slot, memory, number, robot, setup)
    v = approach(slot.v, wanted_v, robot.acceleration * setup.period)
    w = approach(slot.w, wanted_w, robot.turn_acceleration * setup.period)
    pieces = max(
        1,
        math.ceil((abs(v) + abs(w) * robot.body_radius) * setup.period / _MOTION_STEP_M),
    )
    x, y, yaw = slot.true_x, slot.true_y, slot.true_yaw
    has_contact = False
    for _ in range(pieces):
        next_x, next_y, next_yaw = drive(x, y, yaw, v, w, setup.period / pieces)
        skid = robot.sideslip * v * w * setup.period / pieces
        next_x += skid * math.sin(next_yaw)
        next_y -= skid * math.cos(next_yaw)
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
    settle(slot, memory, number, setup, x, y, yaw, v, w, has_contact)


@compiled
def settle(
    slot: Slot,
    memory: Memory,
    number: int,
    setup: Conditions,
    x: float,
    y: float,
    yaw: float,
    v: float,
    w: float,
    has_contact: bool,
) -> None:
    """Record where a tick has truly brought the robot, and whether that ends the episode."""
    _believe(slot, setup, x - slot.true_x, y - slot.true_y, wrap(yaw - slot.true_yaw))
    slot.path_length += math.hypot(x - slot.true_x, y - slot.true_y)
    slot.true_x, slot.true_y, slot.true_yaw = x, y, wrap(yaw)
    slot.v, slot.w = v, w
    slot.tick += 1
    remember_pose(slot, memory, number)
    if slot.command_v < 0.0:
        slot.negative_count += 1
    if slot.command_v <= NOT_FORWARD_SPEED_MPS:
        slot.not_forward_count += 1
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
def _believe(slot: Slot, setup: Conditions, moved_x: float, moved_y: float, turned: float) -> None:
    """Carry the believed pose on by a true motion [m, rad], as odometry with its errors does."""
    cosine, sine = math.cos(slot.true_yaw), math.sin(slot.true_yaw)
    ahead = slot.way_gain * (cosine * moved_x + sine * moved_y)
    aside = slot.way_gain * (cosine * moved_y - sine * moved_x)
    wander = 0.0
    if setup.odometry_drift > 0.0:
        way = math.hypot(moved_x, moved_y)
        wander = setup.odometry_drift * math.sqrt(way) * draw_normal(slot)
    cosine, sine = math.cos(slot.odometry_yaw), math.sin(slot.odometry_yaw)
    slot.odometry_x += cosine * ahead - sine * aside
    slot.odometry_y += sine * ahead + cosine * aside
    slot.odometry_yaw = wrap(slot.odometry_yaw + slot.odometry_gain * turned + wander)
    slot.x, slot.y, slot.yaw = slot.odometry_x, slot.odometry_y, slot.odometry_yaw
    if setup.position_noise > 0.0:
        slot.x += setup.position_noise * draw_normal(slot)
        slot.y += setup.position_noise * draw_normal(slot)
    if setup.heading_noise > 0.0:
        slot.yaw = wrap(slot.yaw + setup.heading_noise * draw_normal(slot))


@compiled
def remember_pose(slot: Slot, memory: Memory, number: int) -> None:
    """Keep true and believed pose for the scans that arrive late."""
    past = memory.past_poses[number, slot.tick % memory.past_poses.shape[1]]
    past[0], past[1], past[2] = slot.true_x, slot.true_y, slot.true_yaw
    past[3], past[4], past[5] = slot.x, slot.y, slot.yaw
