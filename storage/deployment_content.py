"""What the drives of one robot's log left behind, as the content of a bag."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ses_core.arrays import FloatArray, IntArray
from ses_core.extraction.recording import CommandStream, PoseStream, RecordedMap, ScanStream
from ses_core.fleet_settings import START_WINDOW_S
from ses_core.geometry import Pose2D, compose_rows, inverse_rows
from ses_core.robot_profile import RobotProfile
from ses_core.worlds.deployment import Deployment
from ses_core.worlds.fleet_clock import COMMAND, ODOMETRY, SCAN, TRANSFORM, record_stamps
from storage.bag_messages import BagContent

_BEFORE_START_NS = 300_000_000
"""A recorder is up this long before the first drive: latched topics come first."""

_GOAL_NS = 40_000_000
"""A goal is set this long before the robot starts for it."""


@dataclass(frozen=True, slots=True)
class _Drive:
    """One deployment on the log's clock and in its odometry frame."""

    poses: PoseStream
    pose_headers: IntArray
    transforms: IntArray
    commands: CommandStream
    scan_stamps: IntArray
    scan_headers: IntArray
    ranges: "np.ndarray[tuple[int, int], np.dtype[np.float32]]"
    corrections: FloatArray
    goal: tuple[float, float, float]


def content_of(
    deployments: Sequence[Deployment],
    starts_ns: Sequence[int],
    *,
    profile: RobotProfile,
    publishes_map: bool,
) -> BagContent:
    """Put the drives of a log together.

    The robot's odometry goes on where it was when the last drive ended, although somebody has
    carried the robot to another start: the recorder paused meanwhile.

    Args:
        deployments: One after the other, all in one world.
        starts_ns: When each was planned to begin.
        profile: The robot that drove.
        publishes_map: Record the world's map too, and where the odometry frame lies in it.
    """
    drives: list[_Drive] = []
    origin = Pose2D(0.0, 0.0)
    for deployment, start_ns in zip(deployments, starts_ns, strict=True):
        drives.append(_drive(deployment, start_ns, origin, in_map=publishes_map))
        origin = Pose2D(*drives[-1].poses.poses[-1].tolist())
    laser, first_ns = profile.laser, int(drives[0].poses.stamps_ns[0])
    return BagContent(
        poses=PoseStream(
            stamps_ns=np.concatenate([drive.poses.stamps_ns for drive in drives]),
            poses=np.concatenate([drive.poses.poses for drive in drives]),
            twists=np.concatenate([drive.poses.twists for drive in drives]),
        ),
        commands=CommandStream(
            stamps_ns=np.concatenate([drive.commands.stamps_ns for drive in drives]),
            commands=np.concatenate([drive.commands.commands for drive in drives]),
        ),
        scans=ScanStream(
            stamps_ns=np.concatenate([drive.scan_stamps for drive in drives]),
            ranges=np.concatenate([drive.ranges for drive in drives]),
            angles=np.linspace(laser.angle_min_rad, laser.angle_max_rad, laser.beams),
            range_max=laser.range_max_m,
            mount=Pose2D(laser.mount_x_m, laser.mount_y_m, laser.mount_yaw_rad),
        ),
        map=_map(deployments[0]) if publishes_map else None,
        map_to_odom=np.concatenate([drive.corrections for drive in drives])
        if publishes_map
        else None,
        goals=np.array([drive.goal for drive in drives]),
        goal_stamps_ns=np.array([drive.poses.stamps_ns[0] - _GOAL_NS for drive in drives]),
        recorder_start_ns=first_ns - _BEFORE_START_NS,
        pose_headers_ns=np.concatenate([drive.pose_headers for drive in drives]),
        transform_stamps_ns=np.concatenate([drive.transforms for drive in drives]),
        scan_headers_ns=np.concatenate([drive.scan_headers for drive in drives]),
        range_min=laser.range_min_m,
    )


def _drive(deployment: Deployment, start_ns: int, origin: Pose2D, *, in_map: bool) -> _Drive:
    rng = np.random.default_rng([deployment.seed, deployment.number])
    begun = start_ns + int(rng.integers(round(START_WINDOW_S * 1e9)))
    times = begun + np.rint(deployment.times * 1e9).astype(np.int64)
    odometry = record_stamps(times, ODOMETRY, rng=rng)
    transforms = record_stamps(odometry.header_ns, TRANSFORM, rng=rng)
    commands = record_stamps(times[:-1], COMMAND, rng=rng)
    scans = record_stamps(times[deployment.scan_steps], SCAN, rng=rng)
    poses = compose_rows(np.broadcast_to(_numbers(origin), (len(times), 3)), deployment.odometry)
    corrections = compose_rows(deployment.poses, inverse_rows(poses))
    goal = np.array([*deployment.task.goal, 0.0])
    start = deployment.poses[0, :2]
    goal[2] = np.arctan2(goal[1] - start[1], goal[0] - start[0])
    if not in_map:
        goal = compose_rows(inverse_rows(corrections[:1]), goal[None])[0]
    return _Drive(
        poses=PoseStream(stamps_ns=odometry.log_ns, poses=poses, twists=deployment.measured),
        pose_headers=odometry.header_ns,
        transforms=transforms.log_ns,
        commands=CommandStream(stamps_ns=commands.log_ns, commands=deployment.commands),
        scan_stamps=scans.log_ns,
        scan_headers=scans.header_ns,
        ranges=deployment.ranges,
        corrections=corrections,
        goal=(float(goal[0]), float(goal[1]), float(goal[2])),
    )


def _map(deployment: Deployment) -> RecordedMap:
    grid = deployment.task.world.grid
    return RecordedMap(
        cells=grid.cells.astype(np.uint8),
        resolution=grid.resolution,
        origin=Pose2D(*map(float, grid.origin)),
    )


def _numbers(pose: Pose2D) -> FloatArray:
    return np.array([pose.x, pose.y, pose.yaw])
