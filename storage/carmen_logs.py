"""`CarmenLogReader`: CARMEN text logs, gzipped or not, to a `Recording`.

Lines used: `ODOM x y theta tv rv accel stamp host logger-stamp` and
`FLASER n r_1 ... r_n x y theta odom_x odom_y odom_theta stamp host logger-stamp`.
The order of the lines is the order of events, because stamps go back and forth. In corrected logs
each FLASER is followed by an ODOM line without a stamp that repeats its pose: it takes its
predecessor's stamp, and being the last with that stamp it is where the scan was taken.
"""

import gzip
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ses_core.arrays import Float32Array, FloatArray, IntArray
from ses_core.errors import LogError
from ses_core.extraction.recording import PoseStream, Recording, ScanStream
from ses_core.extraction.stream_cleaning import (
    YEAR_1990_NS,
    YEAR_2100_NS,
    plausible_twists,
    returns_only,
    usable_poses,
)
from ses_core.geometry import Pose2D
from ses_core.robot_profile import RobotProfile
from ses_core.settings import DecoderLimits

FIELD_OF_VIEW = math.pi
"""Of the SICK lasers these logs come from [rad]; odd numbers of beams include both ends."""

STEP_NS = 50_000_000
"""Between two ODOM lines of a log without a clock."""

_LASER_RANGE = 80.0
"""A SICK writes 81 m and more for 'no return' [m]."""

_LINE_LIMIT = 2**20
_BAD_CLOCK_SHARE = 0.5
"""With more than this share of its stamps repeated, a clock cannot tell steps apart."""


@dataclass(slots=True)
class _Lines:
    """What the lines said, in file order."""

    stamps_s: list[float] = field(default_factory=list)
    poses: list[tuple[float, ...]] = field(default_factory=list)
    twists: list[tuple[float, ...]] = field(default_factory=list)
    scan_stamps_s: list[float] = field(default_factory=list)
    scan_steps: list[int] = field(default_factory=list)
    scans: list[Float32Array] = field(default_factory=list)
    messages_in: int = 0
    latest_s: float = 0.0
    warnings: Counter[str] = field(default_factory=Counter)

    def advance(self, stamp_s: float) -> float:
        """Give the time of the next line: its own stamp, or its predecessor's if that is later."""
        if math.isfinite(stamp_s) and stamp_s * 1e9 < YEAR_2100_NS:
            self.latest_s = max(self.latest_s, stamp_s)
        return self.latest_s


@dataclass(frozen=True, slots=True)
class CarmenLogReader:
    """Reads `.log` and `.clf` files; only in the limited process."""

    limits: DecoderLimits

    def read(self, log: Path, *, profile: RobotProfile, pose_source: str) -> Recording:  # noqa: ARG002
        """Decode a log; its ODOM lines are the only poses it has, whatever `pose_source`.

        Raises:
            LogError: It is not a CARMEN log or holds no usable poses.
        """
        lines = _parse(log, byte_limit=self.limits.output_mib * 2**20)
        if not lines.poses:
            raise LogError("missing_topic", "log has no ODOM line")
        poses, stamps = np.array(lines.poses), _nanoseconds(lines.stamps_s)
        usable = usable_poses(poses)
        if 2 * np.count_nonzero(usable) <= len(usable):
            raise LogError("bad_values", "most ODOM lines hold no usable pose")
        has_clock = len(np.unique(stamps)) > (1.0 - _BAD_CLOCK_SHARE) * len(stamps)
        scan_stamps = _nanoseconds(lines.scan_stamps_s)
        if has_clock:
            if np.median(stamps) < YEAR_1990_NS:
                lines.warnings["clock_from_zero"] = 1
            last = np.append(np.diff(stamps) > 0, True)
            lines.warnings["dropped_repeated_stamp"] += int(np.count_nonzero(usable & ~last))
            keep = usable & last
        else:
            lines.warnings["bad_clock"] = 1
            stamps = np.arange(len(stamps), dtype=np.int64) * STEP_NS
            scan_stamps = np.array(lines.scan_steps, dtype=np.int64) * STEP_NS
            keep = usable
        lines.warnings["dropped_bad_pose"] += int(np.count_nonzero(~usable))
        twists = _twists(lines, profile, has_clock=has_clock)
        scans = _scans(lines, scan_stamps)
        dropped = sum(n for name, n in lines.warnings.items() if name.startswith("dropped_"))
        return Recording(
            poses=PoseStream(stamps_ns=stamps[keep], poses=poses[keep], twists=twists[keep]),
            commands=None,
            scans=scans,
            map=None,
            pose_source="odometry",
            has_clock=has_clock,
            messages_in=lines.messages_in,
            messages_used=lines.messages_in - dropped,
            warnings={name: count for name, count in sorted(lines.warnings.items()) if count},
        )


def _parse(log: Path, *, byte_limit: int) -> _Lines:
    lines = _Lines()
    for words in _words(log, byte_limit=byte_limit):
        if words[0] not in (b"ODOM", b"FLASER"):
            continue
        lines.messages_in += 1
        try:
            if words[0] == b"ODOM":
                numbers = tuple(float(word) for word in words[1:8])
                if len(numbers) < 7:
                    raise ValueError("ODOM line is too short")
                lines.stamps_s.append(lines.advance(numbers[6]))
                lines.poses.append(numbers[:3])
                lines.twists.append(numbers[3:5])
            else:
                beams = int(words[1])
                stamp = float(words[8 + beams])
                readings = np.array(words[2 : 2 + beams], dtype=np.float32)
                lines.scan_stamps_s.append(lines.advance(stamp))
                lines.scan_steps.append(len(lines.poses))
                lines.scans.append(readings)
        except (ValueError, IndexError, OverflowError):
            lines.warnings["dropped_malformed"] += 1
    if lines.messages_in == 0:
        raise LogError("bad_magic", "file has no line of a CARMEN log")
    return lines


def _words(log: Path, *, byte_limit: int) -> Iterator[list[bytes]]:
    """Give the words of every line, inflating where the file is gzipped."""
    with log.open("rb") as file:
        is_gzipped = file.read(2) == b"\x1f\x8b"
    read = 0
    try:
        with gzip.open(log, "rb") if is_gzipped else log.open("rb") as content:
            while line := content.readline(_LINE_LIMIT):
                read += len(line)
                if read > byte_limit:
                    raise LogError("decompress_bomb", f"log inflates beyond {byte_limit} bytes")
                if words := line.split():
                    yield words
    except (EOFError, gzip.BadGzipFile) as error:
        raise LogError("truncated", f"gzipped log is damaged: {error}") from error


def _nanoseconds(stamps_s: list[float]) -> IntArray:
    return np.rint(np.array(stamps_s, dtype=np.float64) * 1e9).astype(np.int64)


def _twists(lines: _Lines, profile: RobotProfile, *, has_clock: bool) -> FloatArray:
    """Give measured velocities (K, 2); corrected logs hold only zeros there: unknown, then."""
    twists = np.array(lines.twists)
    if not has_clock or not np.any(twists):
        return np.full(twists.shape, np.nan)
    clean, absurd = plausible_twists(twists, profile)
    lines.warnings["absurd_velocity"] += absurd
    return clean


def _scans(lines: _Lines, stamps: IntArray) -> ScanStream | None:
    beams = Counter(len(scan) for scan in lines.scans if len(scan) > 1)
    if not beams:
        lines.warnings["dropped_empty_scan"] += len(lines.scans)
        lines.warnings["no_scans"] = 1
        return None
    count = beams.most_common(1)[0][0]
    alike = np.array([index for index, scan in enumerate(lines.scans) if len(scan) == count])
    lines.warnings["dropped_scan_geometry"] += len(lines.scans) - len(alike)
    fresh = np.append(True, np.diff(stamps[alike]) > 0)
    lines.warnings["dropped_repeated_stamp"] += int(np.count_nonzero(~fresh))
    kept = alike[fresh]
    ranges = np.stack([lines.scans[index] for index in kept])
    increment = FIELD_OF_VIEW / (count - 1 if count % 2 else count)
    return ScanStream(
        stamps_ns=stamps[kept],
        ranges=returns_only(ranges, range_min=0.0, range_max=_LASER_RANGE),
        angles=-FIELD_OF_VIEW / 2.0 + increment * np.arange(count, dtype=np.float64),
        range_max=_LASER_RANGE,
        mount=Pose2D(0.0, 0.0, 0.0),
    )
