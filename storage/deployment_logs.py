"""A simulated fleet's deployments as the logs a real fleet would have left in an inbox.

One log per deployment, in `<out>/<site>/<robot>/`: a site is a world, its robots take turns.
The nightly run cannot tell these logs from a robot's.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from pathlib import Path
from typing import Literal

import numpy as np

from ses_core.errors import WorldError
from ses_core.extraction.recording import CommandStream, PoseStream, Recording, ScanStream
from ses_core.extraction.resampling import find_cuts, resample, velocity_source
from ses_core.geometry import Pose2D, to_frame, wrap_angle
from ses_core.navigation import NavigationTask
from ses_core.recipes import digest_json
from ses_core.robot_profile import RobotProfile
from ses_core.settings import IngestSettings
from ses_core.worlds.deployment import Deployment
from storage.durable_files import make_folder, write_if_absent
from storage.rosbag_writer import BagContent, write_rosbag
from storage.trajectory_tables import LogDescription, write_ingested

FleetFormat = Literal["mcap", "db3", "bag", "tables"]

_DAY_STARTS = time(6, 0, tzinfo=UTC)
_SPACING = timedelta(seconds=150)
"""From one start of a robot to its next: a whole episode and a pause."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FleetLog:
    """A log that was written: where, for which deployment, with how many messages."""

    path: Path
    number: int
    site: str
    robot: str
    messages: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shift:
    """Which robot drives a task, where, and as its how-manieth that day."""

    site: str
    robot: str
    turn: int


def write_deployments(
    out: Path,
    deployments: Iterable[Deployment],
    *,
    tasks: Sequence[NavigationTask],
    format: FleetFormat,  # noqa: A002 - the contract's word
    profile: RobotProfile,
    day: date,
    robots_per_site: int = 2,
) -> list[FleetLog]:
    """Write deployments of these tasks as they come.

    A log is complete before its `.done` sidecar appears.

    Raises:
        WorldError: A log of that name is already there.
    """
    shifts = _shifts(tasks, robot=profile.name, robots_per_site=robots_per_site)
    return [
        _write_deployment(
            out, deployment, shifts[deployment.number], format=format, profile=profile, day=day
        )
        for deployment in deployments
    ]


def recording_of(deployment: Deployment, *, profile: RobotProfile, start_ns: int) -> Recording:
    """Give a deployment as what a decoder would read from its bag, beginning at a stamp [ns]."""
    laser = profile.laser
    stamps = start_ns + np.rint(deployment.times * 1e9).astype(np.int64)
    messages = 2 * len(stamps) + len(deployment.commands) + len(deployment.scan_steps) + 2
    return Recording(
        poses=PoseStream(stamps_ns=stamps, poses=deployment.odometry, twists=deployment.measured),
        commands=CommandStream(stamps_ns=stamps[:-1], commands=deployment.commands),
        scans=ScanStream(
            stamps_ns=stamps[deployment.scan_steps],
            ranges=deployment.ranges,
            angles=np.linspace(laser.angle_min_rad, laser.angle_max_rad, laser.beams),
            range_max=laser.range_max_m,
            mount=Pose2D(laser.mount_x_m, laser.mount_y_m, laser.mount_yaw_rad),
        ),
        map=None,
        pose_source="odometry",
        has_clock=True,
        messages_in=messages,
        messages_used=messages,
    )


def _shifts(tasks: Sequence[NavigationTask], *, robot: str, robots_per_site: int) -> list[_Shift]:
    """Let a site's robots take turns at its tasks."""
    driven: Counter[str] = Counter()
    shifts = []
    for task in tasks:
        site = _plain_name(task.world.world_id)
        turn, number = divmod(driven[site], robots_per_site)
        shifts.append(_Shift(site=site, robot=f"{robot}-{number + 1}", turn=turn))
        driven[site] += 1
    return shifts


def _write_deployment(
    out: Path,
    deployment: Deployment,
    shift: _Shift,
    *,
    format: FleetFormat,  # noqa: A002 - the contract's word
    profile: RobotProfile,
    day: date,
) -> FleetLog:
    site, robot = shift.site, shift.robot
    start = datetime.combine(day, _DAY_STARTS) + shift.turn * _SPACING
    name = f"{start:%Y-%m-%dT%H-%M-%S}_{deployment.number:05d}"
    path = out / site / robot / (f"{name}.bag" if format == "bag" else name)
    if path.exists():
        raise WorldError(f"{path} is already there, expected a folder without it")
    make_folder(path.parent)
    recording = recording_of(deployment, profile=profile, start_ns=round(start.timestamp()) * 10**9)
    if format == "tables":
        _write_tables(path, recording, site=site, robot=robot, profile=profile, day=day)
    else:
        write_rosbag(path, _bag_content(deployment, recording), format=format)
    write_if_absent(path.with_name(f"{path.name}.done"), b"")
    return FleetLog(
        path=path,
        number=deployment.number,
        site=site,
        robot=robot,
        messages=recording.messages_in,
    )


def _bag_content(deployment: Deployment, recording: Recording) -> BagContent:
    start, goal = deployment.task.start, deployment.task.goal
    x, y = to_frame(np.array([goal]), start)[0].tolist()
    bearing = wrap_angle(float(np.arctan2(y, x)))
    return BagContent(
        poses=recording.poses,
        commands=recording.commands,
        scans=recording.scans,
        goals=np.array([[x, y, bearing]]),
        goal_stamps_ns=recording.poses.stamps_ns[:1],
    )


def _write_tables(
    path: Path, recording: Recording, *, site: str, robot: str, profile: RobotProfile, day: date
) -> None:
    """Write what ingest would have made of the bag, without the bag."""
    settings = IngestSettings()
    cuts = find_cuts(recording, profile=profile, settings=settings)
    make_folder(path)
    description = LogDescription(
        log_id=digest_json(["deployment", site, robot, path.name]),
        name=path.name,
        robot=robot,
        site=site,
        format="tables",
        batch_date=day,
        profile=profile.name,
        velocity_source=velocity_source(recording, settings),
    )
    write_ingested(
        path,
        description,
        recording,
        resample(recording, profile=profile, settings=settings),
        cut_counts={"dropouts": int(cuts.is_gap.sum()), "pose_jumps": int(cuts.is_jump.sum())},
    )


def _plain_name(name: str) -> str:
    """Keep what every file system and every log's rule for names can bear."""
    return "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in name)
