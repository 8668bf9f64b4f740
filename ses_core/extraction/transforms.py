"""Rigid transforms between named frames, and where a laser sits on a driving body."""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.geometry import Pose2D

FrameTransforms = Mapping[tuple[str, str], FloatArray]
"""(parent, child) -> the (4, 4) matrix that takes points of the child to the parent."""

_SHORTEST_QUATERNION = 0.1


@dataclass(frozen=True, slots=True)
class PlanarMount:
    """A laser seen from above: its pose on the body, and whether it hangs upside down."""

    pose: Pose2D
    is_upside_down: bool


def transform_matrix(position: Sequence[float], orientation: Sequence[float]) -> FloatArray | None:
    """Give the (4, 4) matrix of a position [m] and quaternion (x, y, z, w); None if unusable."""
    x, y, z, w = orientation
    norm = math.sqrt(x * x + y * y + z * z + w * w) if _all_finite(orientation) else 0.0
    if norm < _SHORTEST_QUATERNION or not _all_finite(position):
        return None
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    matrix = np.eye(4)
    matrix[:3, :3] = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    matrix[:3, 3] = position
    return matrix


def chain(transforms: FrameTransforms, parent: str, child: str) -> FloatArray | None:
    """Compose transforms along the shortest way from one frame to another, either direction.

    Returns:
        The (4, 4) matrix that takes points of the child to the parent; None where no way leads.
    """
    neighbours: dict[str, dict[str, FloatArray]] = {}
    for (above, below), matrix in transforms.items():
        neighbours.setdefault(above, {})[below] = matrix
        back = np.linalg.inv(matrix).astype(np.float64)
        neighbours.setdefault(below, {}).setdefault(above, back)
    reached = {parent: np.eye(4)}
    waiting = deque((parent,))
    while waiting:
        frame = waiting.popleft()
        if frame == child:
            return reached[frame]
        for neighbour, matrix in neighbours.get(frame, {}).items():
            if neighbour not in reached:
                reached[neighbour] = reached[frame] @ matrix
                waiting.append(neighbour)
    return None


def planar_mount(matrix: FloatArray) -> PlanarMount:
    """Look at a mount (4, 4) from above.

    A laser that hangs upside down counts its angles clockwise; its heading is still that of its
    own x axis.
    """
    yaw = math.atan2(matrix[1, 0], matrix[0, 0])
    pose = Pose2D(float(matrix[0, 3]), float(matrix[1, 3]), yaw)
    return PlanarMount(pose=pose, is_upside_down=bool(matrix[2, 2] < 0.0))


def _all_finite(values: Sequence[float]) -> bool:
    return all(math.isfinite(value) for value in values)
