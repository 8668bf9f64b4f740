"""What is drawn anew for every episode: where it starts, and how this robot is off today."""

import math
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from ses_core.arrays import FloatArray
from ses_core.geometry import Pose2D
from ses_core.imperfections import Imperfections
from ses_core.navigation import NavigationTask
from ses_core.occupancy import occupied_at
from ses_core.robot_profile import RobotProfile

_ATTEMPTS = 8
_POINTS_PER_EDGE = 8
_LEAST_GAIN = 0.3
"""A robot that hardly turns at all is broken, not imperfect."""


class EpisodeStart(NamedTuple):
    """Start pose and constant errors of one episode; see `state.Slot` for the gains."""

    pose: Pose2D
    turn_gain: float
    way_gain: float
    odometry_gain: float


def draw_start(
    task: NavigationTask, *, profile: RobotProfile, levels: Imperfections, rng: Generator
) -> EpisodeStart:
    """Draw a start; where no shifted one is free of obstacles, the robot stands as asked."""
    turn, way, odometry = rng.standard_normal(3)
    pose = task.start
    for _ in range(_ATTEMPTS if levels.start_shift_m or levels.start_turn_rad else 0):
        away, towards, turned = rng.uniform((0.0, -math.pi, -1.0), (1.0, math.pi, 1.0))
        # The root spreads the shifts evenly over a disc.
        shift = levels.start_shift_m * math.sqrt(away)
        shifted = Pose2D(
            task.start.x + shift * math.cos(towards),
            task.start.y + shift * math.sin(towards),
            task.start.yaw + levels.start_turn_rad * turned,
        )
        if not occupied_at(task.world.grid, padded_outline(shifted, profile)).any():
            pose = shifted
            break
    return EpisodeStart(
        pose=pose,
        turn_gain=max(_LEAST_GAIN, 1.0 + levels.turn_slip * turn),
        way_gain=1.0 + levels.odometry_drift * way,
        odometry_gain=1.0 + levels.odometry_drift * odometry,
    )


def padded_outline(pose: Pose2D, profile: RobotProfile) -> FloatArray:
    """Points (P, 2) [m] along the edge of the padded body at a pose."""
    corners = np.array(profile.padded_footprint())
    along = np.linspace(0.0, 1.0, _POINTS_PER_EDGE, endpoint=False)[:, None, None]
    edge = ((1.0 - along) * corners + along * np.roll(corners, -1, axis=0)).reshape(-1, 2)
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    return edge @ np.array([[cosine, sine], [-sine, cosine]]) + np.array([pose.x, pose.y])
