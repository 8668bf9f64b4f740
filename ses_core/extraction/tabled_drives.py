"""Trajectories out of a log that was on the clock already, checked and cleaned as any other."""

from dataclasses import dataclass

import numpy as np

from ses_core.arrays import FloatArray, IntArray
from ses_core.errors import LogError
from ses_core.extraction.recording import Recording, ScanStream
from ses_core.extraction.resampling import NOISE_SPEED, velocity_source
from ses_core.extraction.stream_cleaning import plausible_twists
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import wrap_angles
from ses_core.robot_profile import RobotProfile
from ses_core.settings import IngestSettings

_JITTER_PERIODS = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TabledLog:
    """A log that is on the clock already.

    Attributes:
        recording: Its steps as poses and commands, its scans, its map; what it says of itself.
        first_steps: (D,) number of each unbroken drive's first step.
        lengths: (D,) steps of each drive; together those of the recording's poses.
        scan_poses: (S, 3) [m, m, rad] of the body at each scan.
    """

    recording: Recording
    first_steps: IntArray
    lengths: IntArray
    scan_poses: FloatArray


def split_drives(
    log: TabledLog, *, profile: RobotProfile, settings: IngestSettings
) -> list[Trajectory]:
    """Give one trajectory per unbroken drive.

    Args:
        log: Read and checked.
        profile: The robot that recorded it.
        settings: The clock, and which velocity counts.

    Raises:
        LogError: Steps are on another clock, or no such robot drives like that.
    """
    recording, steps = log.recording, log.recording.poses
    period = round(1e9 / settings.step_rate_hz)
    measured, _ = plausible_twists(steps.twists, profile)
    commanded = np.full_like(measured, np.nan)
    if recording.commands is not None:
        commanded, _ = plausible_twists(recording.commands.commands, profile)
    source = velocity_source(recording, settings)
    ends = np.cumsum(log.lengths)
    trajectories = []
    for first_step, start, end in zip(log.first_steps, ends - log.lengths, ends, strict=True):
        drive = slice(int(start), int(end))
        stamps, poses = steps.stamps_ns[drive], steps.poses[drive]
        _require_drivable(stamps, poses, period, profile)
        speeds = {"commanded": commanded[drive, 0], "measured": measured[drive, 0]}
        following = steps.stamps_ns[end] if end < ends[-1] else np.iinfo(np.int64).max
        scans, bodies = _scans_between(log, int(stamps[0]), int(following))
        trajectories.append(
            Trajectory(
                first_step=int(first_step),
                stamps_ns=stamps,
                poses=poses,
                commanded=commanded[drive],
                measured=measured[drive],
                speed=speeds[source] if source in speeds else _derived_speed(poses, period),
                has_clock=True,
                scans=scans,
                scan_poses=bodies,
            )
        )
    return trajectories


def _require_drivable(
    stamps: IntArray, poses: FloatArray, period: int, profile: RobotProfile
) -> None:
    if np.any(np.diff(stamps) != period):
        raise LogError(
            "bad_clock", f"steps are not {period / 1e9:g} s apart, as the setting of the clock says"
        )
    moved = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    farthest = profile.max_speed_mps * period * 1e-9 * (1.0 + _JITTER_PERIODS)
    if np.any(moved > farthest):
        raise LogError(
            "bad_values",
            f"a step is {moved.max():.3g} m long, expected at most {farthest:.3g} m of a robot of "
            f"profile {profile.name}",
        )


def _derived_speed(poses: FloatArray, period: int) -> FloatArray:
    """Give the signed speed (K,) [m/s] along the heading, over the step that follows."""
    if len(poses) < 2:
        return np.zeros(len(poses))
    moved = np.diff(poses[:, :2], axis=0)
    heading = poses[:-1, 2] + wrap_angles(np.diff(poses[:, 2])) / 2.0
    speed = (moved[:, 0] * np.cos(heading) + moved[:, 1] * np.sin(heading)) / (period * 1e-9)
    speed[np.abs(speed) < NOISE_SPEED] = 0.0
    return np.append(speed, speed[-1])


def _scans_between(
    log: TabledLog, start: int, end: int
) -> tuple[ScanStream | None, FloatArray | None]:
    scans = log.recording.scans
    if scans is None:
        return None, None
    first, last = np.searchsorted(scans.stamps_ns, (start, end))
    between = ScanStream(
        stamps_ns=scans.stamps_ns[first:last],
        ranges=scans.ranges[first:last],
        angles=scans.angles,
        range_max=scans.range_max,
        mount=scans.mount,
    )
    return between, log.scan_poses[first:last]
