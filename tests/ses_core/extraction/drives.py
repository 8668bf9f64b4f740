"""Drives for tests: trajectories along given points, in rooms of known walls."""

import math

import numpy as np

from ses_core.arrays import BoolArray, FloatArray
from ses_core.extraction.recording import ScanStream
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import Pose2D, compose, compose_all

STEP_NS = 50_000_000


def drive_along(
    points: FloatArray,
    *,
    speed: FloatArray | None = None,
    first_step: int = 0,
    has_clock: bool = True,
    scans: ScanStream | None = None,
    scan_poses: FloatArray | None = None,
) -> Trajectory:
    """Make a trajectory with one step at each of the points (K, 2) [m]."""
    points = np.asarray(points, dtype=np.float64)
    count = len(points)
    ahead = np.diff(points, axis=0, append=points[-1:])
    yaw = np.arctan2(ahead[:, 1], ahead[:, 0])
    return Trajectory(
        first_step=first_step,
        stamps_ns=np.arange(count, dtype=np.int64) * STEP_NS,
        poses=np.column_stack((points, yaw)),
        commanded=np.full((count, 2), np.nan),
        measured=np.full((count, 2), np.nan),
        speed=np.full(count, 0.5) if speed is None else np.asarray(speed, dtype=np.float64),
        has_clock=has_clock,
        scans=scans,
        scan_poses=scan_poses,
    )


def straight(length: float, *, steps_per_metre: int = 40) -> FloatArray:
    """Give points (K, 2) [m] from the origin along x; whole metres are exact."""
    x = np.arange(math.ceil(length * steps_per_metre) + 1) / steps_per_metre
    return np.column_stack((x, np.zeros_like(x)))


def wandering(seed: int, count: int) -> FloatArray:
    """Give points (count, 2) [m] of a smooth aimless drive."""
    rng = np.random.default_rng(seed)
    heading = np.cumsum(rng.normal(0.0, 0.1, count))
    stride = rng.uniform(0.0, 0.1, count)
    steps = stride[:, None] * np.column_stack((np.cos(heading), np.sin(heading)))
    return np.cumsum(steps, axis=0) + rng.uniform(-100.0, 100.0, 2)


def scanned_drive(
    points: FloatArray,
    walls: FloatArray,
    *,
    mount: Pose2D | None = None,
    frame: Pose2D | None = None,
    beams: int = 720,
    range_max: float = 30.0,
    every: int = 4,
    speed: FloatArray | None = None,
    lost: BoolArray | None = None,
) -> Trajectory:
    """Drive along points (K, 2) [m] between walls (W, 4) [m], scanning exactly.

    Args:
        points: The way, before it is laid into `frame`.
        walls: Segments x0, y0, x1, y1.
        mount: Pose of the laser on the body.
        frame: Where the whole place lies in the world.
        beams: Readings over the full circle.
        range_max: Nothing beyond [m] returns.
        every: Steps from one scan to the next.
        speed: (K,) [m/s].
        lost: (B,) beams that never return.
    """
    mount = mount or Pose2D(0.0, 0.0)
    frame = frame or Pose2D(0.0, 0.0)
    local = drive_along(points, speed=speed)
    bodies = local.poses[::every]
    sensors = compose_all(bodies, mount)
    angles = np.linspace(-math.pi, math.pi, beams, endpoint=False)
    ranges = np.stack([cast(sensor, angles, walls) for sensor in sensors])
    ranges[ranges > range_max] = np.inf
    if lost is not None:
        ranges[:, lost] = np.inf
    poses = in_world(local.poses, frame)
    return drive_along_poses(
        poses,
        speed=local.speed,
        scans=ScanStream(
            stamps_ns=local.stamps_ns[::every],
            ranges=ranges.astype(np.float32),
            angles=angles,
            range_max=range_max,
            mount=mount,
        ),
        scan_poses=poses[::every],
    )


def drive_along_poses(
    poses: FloatArray, *, speed: FloatArray, scans: ScanStream, scan_poses: FloatArray
) -> Trajectory:
    """Make a trajectory of given poses (K, 3) [m, m, rad]."""
    count = len(poses)
    return Trajectory(
        first_step=0,
        stamps_ns=np.arange(count, dtype=np.int64) * STEP_NS,
        poses=poses,
        commanded=np.full((count, 2), np.nan),
        measured=np.full((count, 2), np.nan),
        speed=speed,
        has_clock=True,
        scans=scans,
        scan_poses=scan_poses,
    )


def in_world(poses: FloatArray, frame: Pose2D) -> FloatArray:
    """Lay poses (K, 3) given in a frame into the world."""
    placed = [compose(frame, Pose2D(*(float(value) for value in pose))) for pose in poses]
    return np.array([[pose.x, pose.y, pose.yaw] for pose in placed])


def cast(sensor: FloatArray, angles: FloatArray, walls: FloatArray) -> FloatArray:
    """Measure exact ranges (B,) [m] from a pose (3,) to walls (W, 4), by line intersection."""
    directions = np.column_stack((np.cos(sensor[2] + angles), np.sin(sensor[2] + angles)))
    along = walls[:, 2:] - walls[:, :2]
    offset = walls[:, :2] - sensor[:2]
    cross = directions[:, :1] * along[:, 1] - directions[:, 1:] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (offset[:, 0] * along[:, 1] - offset[:, 1] * along[:, 0]) / cross
        share = (offset[:, 0] * directions[:, 1:] - offset[:, 1] * directions[:, :1]) / cross
    is_met = (reach > 0.0) & (share >= 0.0) & (share <= 1.0)
    nearest: FloatArray = np.where(is_met, reach, np.inf).min(axis=1)
    return nearest


CORRIDOR = np.array(
    [
        # Two metres wide and 12 m long, with a pillar 0.4 m square on the left.
        [-3.0, 1.0, 9.0, 1.0],
        [-3.0, -1.0, 9.0, -1.0],
        [-3.0, -1.0, -3.0, 1.0],
        [9.0, -1.0, 9.0, 1.0],
        [2.3, 0.4, 2.7, 0.4],
        [2.3, 0.8, 2.7, 0.8],
        [2.3, 0.4, 2.3, 0.8],
        [2.7, 0.4, 2.7, 0.8],
    ]
)
"""Walls (W, 4) [m] of a corridor along x."""
