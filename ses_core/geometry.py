"""Planar poses: angle wrapping, composition and change of frame."""

import math
from dataclasses import dataclass

import numpy as np

from ses_core.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Pose2D:
    """Position [m] and heading [rad, in (-pi, pi]] in a named frame."""

    x: float
    y: float
    yaw: float = 0.0


def wrap_angle(angle: float) -> float:
    """Bring an angle [rad] into (-pi, pi]."""
    wrapped = math.remainder(angle, 2.0 * math.pi)
    return math.pi if wrapped == -math.pi else wrapped


def wrap_angles(angles: FloatArray) -> FloatArray:
    """Bring angles [rad] of any shape into (-pi, pi]."""
    return -(np.mod(-np.asarray(angles) + np.pi, 2.0 * np.pi) - np.pi)


def compose(outer: Pose2D, inner: Pose2D) -> Pose2D:
    """Express in the outer pose's parent frame a pose given relative to the outer pose."""
    cosine, sine = math.cos(outer.yaw), math.sin(outer.yaw)
    return Pose2D(
        outer.x + cosine * inner.x - sine * inner.y,
        outer.y + sine * inner.x + cosine * inner.y,
        wrap_angle(outer.yaw + inner.yaw),
    )


def compose_all(outer: FloatArray, inner: Pose2D) -> FloatArray:
    """Compose every pose of (K, 3) [m, m, rad] with one pose given relative to it."""
    cosine, sine = np.cos(outer[:, 2]), np.sin(outer[:, 2])
    return np.column_stack(
        (
            outer[:, 0] + cosine * inner.x - sine * inner.y,
            outer[:, 1] + sine * inner.x + cosine * inner.y,
            wrap_angles(outer[:, 2] + inner.yaw),
        )
    )


def compose_rows(outer: FloatArray, inner: FloatArray) -> FloatArray:
    """Compose poses (K, 3) [m, m, rad] row by row."""
    cosine, sine = np.cos(outer[:, 2]), np.sin(outer[:, 2])
    x = outer[:, 0] + cosine * inner[:, 0] - sine * inner[:, 1]
    y = outer[:, 1] + sine * inner[:, 0] + cosine * inner[:, 1]
    return np.column_stack((x, y, wrap_angles(outer[:, 2] + inner[:, 2])))


def inverse_rows(poses: FloatArray) -> FloatArray:
    """Give the inverse of each pose (K, 3) [m, m, rad]."""
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x = -cosine * poses[:, 0] - sine * poses[:, 1]
    y = sine * poses[:, 0] - cosine * poses[:, 1]
    return np.column_stack((x, y, -poses[:, 2]))


def inverse(pose: Pose2D) -> Pose2D:
    """Give the pose of the parent frame as seen from `pose`."""
    cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
    return Pose2D(
        -cosine * pose.x - sine * pose.y, sine * pose.x - cosine * pose.y, wrap_angle(-pose.yaw)
    )


def to_frame(points: FloatArray, frame: Pose2D) -> FloatArray:
    """Express points (N, 2) [m] of the parent frame in `frame`."""
    cosine, sine = math.cos(frame.yaw), math.sin(frame.yaw)
    shifted = np.asarray(points, dtype=np.float64) - (frame.x, frame.y)
    return shifted @ np.array([[cosine, -sine], [sine, cosine]])


def from_frame(points: FloatArray, frame: Pose2D) -> FloatArray:
    """Express points (N, 2) [m] given in `frame` in its parent frame."""
    cosine, sine = math.cos(frame.yaw), math.sin(frame.yaw)
    rotated = np.asarray(points, dtype=np.float64) @ np.array([[cosine, sine], [-sine, cosine]])
    return rotated + np.array([frame.x, frame.y])
