"""A recording on the clock of the paper: 20 Hz steps, cut where the log has a hole or a jump."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ses_core.arrays import BoolArray, FloatArray, IntArray
from ses_core.extraction.recording import CommandStream, PoseStream, Recording, ScanStream
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import wrap_angles
from ses_core.robot_profile import RobotProfile
from ses_core.settings import IngestSettings

NOISE_SPEED = 0.02
"""A speed derived from poses below this [m/s] is noise of the poses: the robot stands."""

_CLOCKLESS_STEP_S = 1.0
_JITTER_PERIODS = 2.0
"""Log time may be late by this many periods of the odometry, so short intervals prove no jump."""

_STANDSTILL_SCAN_NS = 1_000_000_000
_MOVED_M = 0.01
_TURNED_RAD = 0.01
_RANGE_DECIMALS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Cuts:
    """Where a recording falls apart.

    Attributes:
        is_gap: (K - 1,) the log says nothing for too long between poses k and k + 1.
        is_jump: (K - 1,) no such robot gets from pose k to pose k + 1 in that time.
    """

    is_gap: BoolArray
    is_jump: BoolArray


def find_cuts(recording: Recording, *, profile: RobotProfile, settings: IngestSettings) -> Cuts:
    """Find dropouts and jumps between consecutive poses."""
    stamps, poses = recording.poses.stamps_ns, recording.poses.poses
    distances = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    if not recording.has_clock:
        is_jump = distances > profile.max_speed_mps * _CLOCKLESS_STEP_S
        return Cuts(is_gap=np.zeros(len(distances), dtype=np.bool_), is_jump=is_jump)
    intervals = np.diff(stamps) * 1e-9
    is_gap = intervals > settings.gap_s
    period = float(np.median(intervals)) if len(intervals) else 0.0
    is_jump = distances > profile.max_speed_mps * (intervals + _JITTER_PERIODS * period)
    return Cuts(is_gap=is_gap, is_jump=is_jump & ~is_gap)


def resample(
    recording: Recording, *, profile: RobotProfile, settings: IngestSettings
) -> list[Trajectory]:
    """Put a recording on the clock, one trajectory per unbroken drive.

    Poses are interpolated; a command holds until the next one, but no longer than the robot's
    time-out, and is 0 then; a measurement holds until the next one. Steps are numbered through
    the whole log with one number left out at every cut, so that no number is used twice and
    consecutive numbers are consecutive steps.
    """
    cuts = find_cuts(recording, profile=profile, settings=settings)
    ends = np.flatnonzero(cuts.is_gap | cuts.is_jump) + 1
    bounds = np.concatenate(([0], ends, [len(recording.poses.stamps_ns)]))
    trajectories: list[Trajectory] = []
    first_step = 0
    for start, stop in pairwise(bounds):
        if stop - start < 2:
            continue
        drive = _slice(recording.poses, int(start), int(stop))
        trajectory = _put_on_clock(
            recording, drive, profile=profile, settings=settings, first_step=first_step
        )
        trajectories.append(trajectory)
        first_step += len(trajectory) + 1
    return trajectories


def velocity_source(recording: Recording, settings: IngestSettings) -> str:
    """Say which velocity counts: `commanded`, `measured` or `derived`."""
    if settings.velocity_source != "auto":
        return settings.velocity_source
    if recording.commands is not None:
        return "commanded"
    return "measured" if np.isfinite(recording.poses.twists).any() else "derived"


def _slice(poses: PoseStream, start: int, stop: int) -> PoseStream:
    return PoseStream(
        stamps_ns=poses.stamps_ns[start:stop],
        poses=poses.poses[start:stop],
        twists=poses.twists[start:stop],
    )


def _put_on_clock(
    recording: Recording,
    drive: PoseStream,
    *,
    profile: RobotProfile,
    settings: IngestSettings,
    first_step: int,
) -> Trajectory:
    if recording.has_clock:
        period = round(1e9 / settings.step_rate_hz)
        stamps = np.arange(drive.stamps_ns[0], drive.stamps_ns[-1] + 1, period, dtype=np.int64)
        poses = _interpolate(drive, stamps)
        commanded = _hold_commands(recording.commands, stamps, profile.command_timeout_s)
        measured = drive.twists[_latest(drive.stamps_ns, stamps)]
    else:
        stamps, poses = np.array(drive.stamps_ns), np.array(drive.poses)
        commanded = measured = np.full((len(stamps), 2), np.nan)
    speeds = {
        "commanded": commanded[:, 0],
        "measured": measured[:, 0],
        "derived": _derived_speed(drive, stamps),
    }
    speed = speeds[velocity_source(recording, settings)]
    if not recording.has_clock:
        speed = np.full(len(stamps), np.nan)
    scans, scan_poses = _scans_of(recording.scans, drive)
    return Trajectory(
        first_step=first_step,
        stamps_ns=stamps,
        poses=poses,
        commanded=commanded,
        measured=measured,
        speed=speed,
        has_clock=recording.has_clock,
        scans=scans,
        scan_poses=scan_poses,
    )


def _latest(stamps: IntArray, at: IntArray) -> IntArray:
    """Give the index of the last stamp at or before each moment (K,)."""
    return np.searchsorted(stamps, at, side="right") - 1


def _interpolate(drive: PoseStream, at: IntArray) -> FloatArray:
    """Interpolate poses at moments (K,) [ns] within the drive."""
    # Relative to the start, nanoseconds of a drive are exact as floats; since 1970 they are not.
    origin = drive.stamps_ns[0]
    known, wanted = (drive.stamps_ns - origin).astype(float), (at - origin).astype(float)
    yaw = np.unwrap(drive.poses[:, 2])
    return np.column_stack(
        (
            np.interp(wanted, known, drive.poses[:, 0]),
            np.interp(wanted, known, drive.poses[:, 1]),
            wrap_angles(np.interp(wanted, known, yaw)),
        )
    )


def _hold_commands(commands: CommandStream | None, at: IntArray, timeout_s: float) -> FloatArray:
    """Give the command in force (K, 2) at each moment; NaN where the log has no commands."""
    if commands is None:
        return np.full((len(at), 2), np.nan)
    latest = _latest(commands.stamps_ns, at)
    index = np.maximum(latest, 0)
    age = at - commands.stamps_ns[index]
    in_force = (latest >= 0) & (age <= round(timeout_s * 1e9))
    return np.where(in_force[:, None], commands.commands[index], 0.0)


def _derived_speed(drive: PoseStream, at: IntArray) -> FloatArray:
    """Give the signed speed (K,) [m/s] along the heading over the interval each moment lies in."""
    moved = np.diff(drive.poses[:, :2], axis=0)
    seconds = np.diff(drive.stamps_ns) * 1e-9
    turned = wrap_angles(np.diff(drive.poses[:, 2]))
    heading = drive.poses[:-1, 2] + turned / 2.0
    speed = (moved[:, 0] * np.cos(heading) + moved[:, 1] * np.sin(heading)) / seconds
    speed[np.abs(speed) < NOISE_SPEED] = 0.0
    return speed[np.minimum(_latest(drive.stamps_ns, at), len(speed) - 1)]


def _scans_of(
    scans: ScanStream | None, drive: PoseStream
) -> tuple[ScanStream | None, FloatArray | None]:
    """Give a drive's scans, thinned to one a second at a standstill, and the poses at them."""
    if scans is None:
        return None, None
    first = np.searchsorted(scans.stamps_ns, drive.stamps_ns[0], side="left")
    last = np.searchsorted(scans.stamps_ns, drive.stamps_ns[-1], side="right")
    stamps = scans.stamps_ns[first:last]
    poses = _interpolate(drive, stamps)
    kept = _moved_or_due(stamps, poses)
    thinned = ScanStream(
        stamps_ns=stamps[kept],
        ranges=np.round(scans.ranges[first:last][kept], _RANGE_DECIMALS),
        angles=scans.angles,
        range_max=scans.range_max,
        mount=scans.mount,
    )
    return thinned, poses[kept]


def _moved_or_due(stamps: IntArray, poses: FloatArray) -> IntArray:
    """Choose scans: those that show something new, and one a second where nothing changes."""
    kept: list[int] = []
    for index in range(len(stamps)):
        if kept:
            last = kept[-1]
            moved = np.hypot(*(poses[index, :2] - poses[last, :2])) > _MOVED_M
            turned = abs(np.remainder(poses[index, 2] - poses[last, 2] + np.pi, 2 * np.pi) - np.pi)
            due = stamps[index] - stamps[last] >= _STANDSTILL_SCAN_NS
            if not (moved or turned > _TURNED_RAD or due):
                continue
        kept.append(index)
    return np.array(kept, dtype=np.int64)
