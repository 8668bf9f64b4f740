"""The simulated robot: its numbers for compiled code, its motion, and what its body touches."""

import math
from typing import NamedTuple

import numpy as np

from ses_core.arrays import ByteArray, FloatArray
from ses_core.compilation import compiled_in_place
from ses_core.robot_profile import RobotProfile

OUTLINE_SPACING_M = 0.165
"""Largest gap [m] between outline points: about a cell of BARN; at least 14 points in all."""

MIN_OUTLINE_POINTS = 14


class RobotModel(NamedTuple):
    """A robot profile as the kernels need it; polygons run counter-clockwise."""

    outline: FloatArray  # (P, 2) points along the padded footprint [m]
    footprint_sides: FloatArray  # (E, 3) padded footprint: inside where a x + b y <= c
    body: FloatArray  # (C, 2) corners of the bare body [m]
    body_sides: FloatArray  # (C, 3)
    body_radius: float  # of the circle around the bare body [m]
    inscribed_radius: float  # of the padded footprint [m]
    circumscribed_radius: float
    track: float  # between the wheels [m]
    max_speed: float
    max_turn_rate: float
    acceleration: float
    turn_acceleration: float
    sideslip: float  # [s]
    min_vel_x: float
    min_in_place_vel_theta: float
    escape_vel: float
    occdist_scale: float
    heading_lookahead: float
    oscillation_reset_dist: float
    escape_reset_dist: float
    escape_reset_theta: float
    beams: FloatArray  # (B, 2) unit vectors in the laser's frame
    mount_x: float
    mount_y: float
    mount_yaw: float
    range_min: float
    range_max: float


def robot_model(profile: RobotProfile) -> RobotModel:
    """Prepare a profile for compiled code.

    Raises:
        ValueError: The footprint is not convex; collision and clearing need convex bodies.
    """
    body = _counter_clockwise(np.asarray(profile.body(), dtype=np.float64))
    padded = _counter_clockwise(np.asarray(profile.padded_footprint(), dtype=np.float64))
    laser = profile.laser
    return RobotModel(
        outline=_points_along(padded),
        footprint_sides=_sides(padded, profile.name),
        body=body,
        body_sides=_sides(body, profile.name),
        body_radius=float(np.hypot(body[:, 0], body[:, 1]).max()),
        inscribed_radius=profile.inscribed_radius_m,
        circumscribed_radius=profile.circumscribed_radius_m,
        track=float(np.ptp(body[:, 1])),
        max_speed=profile.max_speed_mps,
        max_turn_rate=profile.max_turn_rate_radps,
        acceleration=profile.acc_lim_x_mps2,
        turn_acceleration=profile.acc_lim_theta_radps2,
        sideslip=profile.sideslip_s,
        min_vel_x=profile.planner.min_vel_x,
        min_in_place_vel_theta=profile.planner.min_in_place_vel_theta,
        escape_vel=profile.planner.escape_vel,
        occdist_scale=profile.planner.occdist_scale,
        heading_lookahead=profile.planner.heading_lookahead,
        oscillation_reset_dist=profile.planner.oscillation_reset_dist,
        escape_reset_dist=profile.planner.escape_reset_dist,
        escape_reset_theta=profile.planner.escape_reset_theta,
        beams=beam_directions(profile),
        mount_x=laser.mount_x_m,
        mount_y=laser.mount_y_m,
        mount_yaw=laser.mount_yaw_rad,
        range_min=laser.range_min_m,
        range_max=laser.range_max_m,
    )


def beam_directions(profile: RobotProfile) -> FloatArray:
    """Give the beams (B, 2) as unit vectors in the laser's frame."""
    laser = profile.laser
    angles = np.linspace(laser.angle_min_rad, laser.angle_max_rad, laser.beams)
    return np.column_stack((np.cos(angles), np.sin(angles)))


def _counter_clockwise(corners: FloatArray) -> FloatArray:
    following = np.roll(corners, -1, axis=0)
    area = np.sum(corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0])
    return np.ascontiguousarray(corners if area > 0.0 else corners[::-1])


def _sides(corners: FloatArray, name: str) -> FloatArray:
    """Give the half-planes (E, 3) whose intersection a convex polygon is, with unit normals."""
    along = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack((along[:, 1], -along[:, 0]))
    normals /= np.hypot(normals[:, 0], normals[:, 1])[:, None]
    offsets = np.sum(normals * corners, axis=1)
    if np.any(corners @ normals.T > offsets + 1e-9):
        raise ValueError(f"footprint of robot profile {name!r} is not convex, expected convex")
    return np.column_stack((normals, offsets))


def _points_along(corners: FloatArray) -> FloatArray:
    """Spread points along a polygon: its corners, and evenly between them."""
    following = np.roll(corners, -1, axis=0)
    lengths = np.hypot(*(following - corners).T)
    spacing = min(OUTLINE_SPACING_M, float(lengths.sum()) / MIN_OUTLINE_POINTS)
    points = [
        start + (end - start) * k / pieces
        for start, end, length in zip(corners, following, lengths, strict=True)
        for pieces in [max(1, math.ceil(length / spacing - 1e-9))]
        for k in range(pieces)
    ]
    return np.array(points, dtype=np.float64)


@compiled_in_place
def approach(value: float, target: float, step: float) -> float:
    """Move a value towards a target by at most a step."""
    return min(max(target, value - step), value + step)


@compiled_in_place
def drive(
    x: float, y: float, yaw: float, v: float, w: float, time: float
) -> tuple[float, float, float]:
    """Follow the arc of constant v [m/s] and w [rad/s] for a time [s]; exact for a unicycle."""
    turned = yaw + w * time
    if abs(w) < 1e-6:
        middle = yaw + 0.5 * w * time
        return x + v * time * math.cos(middle), y + v * time * math.sin(middle), turned
    radius = v / w
    return (
        x + radius * (math.sin(turned) - math.sin(yaw)),
        y - radius * (math.cos(turned) - math.cos(yaw)),
        turned,
    )


@compiled_in_place
def wrap(angle: float) -> float:
    """Bring an angle [rad] into (-pi, pi]."""
    return angle - 2.0 * math.pi * math.ceil((angle - math.pi) / (2.0 * math.pi))


@compiled_in_place
def touches(
    robot: RobotModel,
    x: float,
    y: float,
    yaw: float,
    clearance: ByteArray,
    offset: int,
    width: int,
    height: int,
    resolution: float,
) -> bool:
    """Tell whether the bare body overlaps an occupied cell: separating axes, exact.

    The position (x, y) [m] is from the world's lower left corner; `clearance` holds the
    chessboard distances of all worlds, this one's from `offset` on.
    """
    column, row = math.floor(x / resolution), math.floor(y / resolution)
    if not (0 <= column < width and 0 <= row < height):
        return True
    near = int(clearance[offset + row * width + column])
    # A cell at chessboard distance n is at least n - 1 whole cells away from the centre.
    if (near - 1) * resolution > robot.body_radius:
        return False
    cosine, sine = math.cos(yaw), math.sin(yaw)
    left = right = x
    bottom = top = y
    for k in range(robot.body.shape[0]):
        corner_x = x + cosine * robot.body[k, 0] - sine * robot.body[k, 1]
        corner_y = y + sine * robot.body[k, 0] + cosine * robot.body[k, 1]
        left, right = min(left, corner_x), max(right, corner_x)
        bottom, top = min(bottom, corner_y), max(top, corner_y)
    # The bounding box is the test along the cells' own axes.
    first_column, last_column = (
        math.floor(left / resolution),
        math.floor(right / resolution),
    )
    first_row, last_row = math.floor(bottom / resolution), math.floor(top / resolution)
    if first_column < 0 or first_row < 0 or last_column >= width or last_row >= height:
        return True
    half = 0.5 * resolution
    for cell_row in range(first_row, last_row + 1):
        for cell_column in range(first_column, last_column + 1):
            if clearance[offset + cell_row * width + cell_column] != 0:
                continue
            away_x = (cell_column + 0.5) * resolution - x
            away_y = (cell_row + 0.5) * resolution - y
            is_apart = False
            for k in range(robot.body_sides.shape[0]):
                normal_x = cosine * robot.body_sides[k, 0] - sine * robot.body_sides[k, 1]
                normal_y = sine * robot.body_sides[k, 0] + cosine * robot.body_sides[k, 1]
                reach = half * (abs(normal_x) + abs(normal_y))
                if normal_x * away_x + normal_y * away_y - reach >= robot.body_sides[k, 2]:
                    is_apart = True
                    break
            if not is_apart:
                return True
    return False
