"""How imperfect real robots are, measured in recorded logs: what the preset `real` is held against.

Every row is one quantity of one log. No row is a level: levels, their sources and how these
values bear on them stand in `docs/imperfections.md`. Drift has a benchmark of its own,
`odometry_drift`.
"""

import os
import shutil
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ses_core.arrays import BoolArray, FloatArray, IntArray
from ses_core.errors import SesError
from ses_core.extraction.recording import PoseStream, Recording
from ses_core.robot_profile import GENERIC
from ses_core.settings import DecoderLimits
from storage.log_decoder import decode_log
from storage.log_formats import CARMEN, ROSBAG1, ROSBAG2_SQLITE
from storage.message_layouts import LASER_SCAN, ODOMETRY
from storage.rosbag_containers import open_recording

Row = dict[str, str | float]
Found = tuple[str, str, int, float]
"""Quantity, unit, samples, value."""

ROBOTS = {
    "zaki": "Raspberry Pi Mouse, URG-04LX",
    "yycho": "Neato XV",
    "ksoltan": "Neato XV",
    "zneb": "Neato XV",
    "macfirst": "TurtleBot 4, RPLidar",
}
"""By the beginning of a log's name; the others are CARMEN logs."""

NEAR_M = 5.0
_STILL = np.array([0.002, 0.002, 0.002])
"""A robot whose pose changes by less than this [m, m, rad] from scan to scan stands."""
_STANDING_S = 1.0
_SETTLE_SCANS = 2
_BURST_S = 0.005
_STABLE_SPREAD_M = 0.2
_SANE_CLOCK_S = 2.0
_LEAST_CORRELATION = 0.7
_LAGS_S = np.arange(0.0, 1.0, 0.01)


def measure(scratch: Path) -> list[Row]:
    """Measure every log of the shared data.

    Raises:
        SesError: The shared data are not there.
    """
    beside = Path(__file__).parents[2] / "shared" / "data"
    logs = Path(os.environ.get("SES_SHARED_DATA", beside)) / "logs"
    if not logs.is_dir():
        raise SesError("found no recorded logs: set SES_SHARED_DATA to the folder that holds logs/")
    rows: list[Row] = []
    for path in (*sorted((logs / "ros1").glob("*.bag")), logs / "ros2" / "macfirst_floor_take_2"):
        rows += _rows(path.name.removesuffix(".bag"), _measure_bag(path, scratch))
    for path in sorted((logs / "carmen").glob("*.gz")):
        lost = _lost_readings(_decode(path, scratch, CARMEN), is_dense=False)
        rows += _rows(path.name.removesuffix("-corrected.log.gz"), lost)
    return sorted(rows, key=lambda row: (str(row["quantity"]), str(row["log"])))


def _rows(log: str, found: list[Found]) -> list[Row]:
    robot = next((kind for key, kind in ROBOTS.items() if log.startswith(key)), "SICK laser")
    return [
        {
            "quantity": quantity,
            "unit": unit,
            "log": log,
            "robot": robot,
            "samples": samples,
            "value": round(float(value), 4),
        }
        for quantity, unit, samples, value in found
    ]


def _measure_bag(path: Path, scratch: Path) -> list[Found]:
    kind = ROSBAG2_SQLITE if path.is_dir() else ROSBAG1
    recording = _decode(path, scratch, kind)
    found = _range_noise(recording) + _lost_readings(recording, is_dense=True)
    found += _pose_jitter(recording, recording.poses, "odometry")
    in_map = _decode(path, scratch, kind, pose_source="map")
    if in_map.pose_source == "map":  # Most logs have none and fall back to odometry.
        found += _pose_jitter(recording, in_map.poses, "map")
    if len(np.unique(recording.poses.twists[:, 0])) > 5:
        # The others report what they were told as what they measured.
        found += _speed_scatter(recording) + _command_lag(recording)
    return found + _message_lag(path, scratch)


def _decode(path: Path, scratch: Path, kind: str, *, pose_source: str = "odometry") -> Recording:
    return decode_log(
        _copy(path, scratch),
        format=kind,
        profile=GENERIC,
        pose_source=pose_source,
        limits=DecoderLimits(),
        workdir=scratch / "decode",
    )


def _copy(path: Path, scratch: Path) -> Path:
    """Copy a log, since opening a database may write beside it."""
    target = scratch / path.name
    if path.is_dir():
        target.mkdir(exist_ok=True)
        for part in path.iterdir():
            shutil.copyfile(part, target / part.name)
    else:
        shutil.copyfile(path, target)
    return target


def _standing(recording: Recording) -> Iterator[slice]:
    """Give the runs of scans during which the robot stood, by its odometry."""
    assert recording.scans is not None
    at_scans = _poses_at(recording.poses, recording.scans.stamps_ns)
    seconds = recording.scans.stamps_ns / 1e9
    intervals = np.diff(seconds)
    if np.quantile(intervals, 0.05) < _BURST_S:
        return  # Messages were held up: log time does not say when the robot stood.
    still = np.all(np.abs(np.diff(at_scans, axis=0)) < _STILL, axis=1)
    for start, stop in _runs(still):
        run = slice(start + _SETTLE_SCANS, stop)
        if run.stop - run.start < 4 or np.ptp(seconds[run]) < _STANDING_S:
            continue
        if np.all(np.ptp(at_scans[run], axis=0) < 2.0 * _STILL):
            yield run


def _poses_at(poses: PoseStream, stamps: IntArray) -> FloatArray:
    """Give poses (K, 3) at stamps; headings are unwrapped."""
    values = np.column_stack((poses.poses[:, :2], np.unwrap(poses.poses[:, 2])))
    return np.column_stack([np.interp(stamps, poses.stamps_ns, column) for column in values.T])


def _runs(flags: BoolArray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _range_noise(recording: Recording) -> list[Found]:
    """Scatter of a beam's readings while the robot stands, from their differences in time.

    Differences leave out whoever walks by slowly; a beam counts that never misses and stays
    within 0.2 m.
    """
    assert recording.scans is not None
    scatter: list[FloatArray] = []
    for run in _standing(recording):
        ranges = recording.scans.ranges[run].astype(np.float64)
        ranges = ranges[:, ranges.max(axis=0) < NEAR_M]
        steps = np.diff(ranges[:, np.ptp(ranges, axis=0) < _STABLE_SPREAD_M], axis=0)
        scatter.append(np.sqrt(np.mean(np.square(steps), axis=0) / 2.0))
    if not scatter:
        return []
    beams = np.concatenate(scatter)
    return [
        ("range noise, median beam", "m", len(beams), np.median(beams)),
        ("range noise, 90th percentile of beams", "m", len(beams), np.quantile(beams, 0.9)),
    ]


def _lost_readings(recording: Recording, *, is_dense: bool) -> list[Found]:
    """Share of readings lost between neighbours that are there; in time too, if scans are dense."""
    assert recording.scans is not None
    near = recording.scans.ranges < NEAR_M
    lost = ~np.isfinite(recording.scans.ranges)
    around = near[1:-1, :-2] & near[1:-1, 2:]
    if is_dense:
        around &= near[:-2, 1:-1] & near[2:, 1:-1]
    count = int(np.count_nonzero(around))
    share = int(np.count_nonzero(around & lost[1:-1, 1:-1])) / max(count, 1)
    kind = "of four neighbours" if is_dense else "of two neighbours in one scan"
    return [(f"isolated losses, {kind}", "share", count, share)]


def _pose_jitter(recording: Recording, poses: PoseStream, frame: str) -> list[Found]:
    """Scatter of the pose's estimate while odometry says that the robot stands."""
    assert recording.scans is not None
    spreads, count = [], 0
    for run in _standing(recording):
        stamps = recording.scans.stamps_ns[run]
        values = _poses_at(poses, stamps)
        spreads.append(np.std(values, axis=0))
        count += len(values)
    if not spreads:
        return []
    x, y, yaw = np.sqrt(np.mean(np.square(np.array(spreads)), axis=0)).tolist()
    return [
        (f"pose jitter standing, {frame}", "m", count, np.hypot(x, y) / np.sqrt(2.0)),
        (f"heading jitter standing, {frame}", "rad", count, yaw),
    ]


def _speed_scatter(recording: Recording) -> list[Found]:
    """Relative scatter of the measured speed while the command is constant and straight on.

    Over 1 s it is the smaller of two estimates, from speeds and from positions: both hold the
    jitter of the messages' times besides the robot's own.
    """
    commands, poses = recording.commands, recording.poses
    if commands is None:
        return []
    held = _held(commands.stamps_ns, commands.commands, poses.stamps_ns)
    changes = np.abs(np.diff(held[:, 0], prepend=np.nan))
    steady = ~(changes > 0.005) & (np.abs(held[:, 0]) > 0.04) & (np.abs(held[:, 1]) < 0.12)
    seconds, speeds = poses.stamps_ns / 1e9, poses.twists[:, 0]
    deviations: list[FloatArray] = []
    means: list[float] = []
    ways: list[float] = []
    for start, stop in _runs(steady & np.isfinite(speeds)):
        inside = np.arange(start, stop)
        inside = inside[seconds[inside] > seconds[start] + 1.0]  # It has got up to speed by then.
        if len(inside) < 8 or abs(mean := float(np.mean(speeds[inside]))) < 0.04:
            continue
        relative = speeds[inside] / mean - 1.0
        deviations.append(relative)
        second = np.floor(seconds[inside] - seconds[inside[0]]).astype(int)
        means += [float(np.mean(relative[second == n])) for n in range(int(second[-1]))]
        marks = np.arange(poses.stamps_ns[inside[0]], poses.stamps_ns[inside[-1]], 10**9)
        way = np.hypot(*np.diff(_poses_at(poses, marks)[:, :2], axis=0).T)
        ways += (way / np.mean(way) - 1.0).tolist() if len(way) > 1 else []
    if not deviations:
        return []
    every, count = np.concatenate(deviations), sum(map(len, deviations))
    following = sum(float(np.sum(part[:-1] * part[1:])) for part in deviations)
    slow = min(float(np.std(means)), float(np.std(ways)))
    return [
        ("speed scatter, per sample", "share", count, float(np.std(every))),
        ("speed scatter, sample interval", "s", count, float(np.median(np.diff(seconds)))),
        ("speed scatter, lag-1 correlation", "1", count, following / float(np.sum(every**2))),
        ("speed scatter, over 1 s", "share", len(ways), slow),
    ]


def _held(stamps: IntArray, values: FloatArray, at: IntArray) -> FloatArray:
    """Give the latest values at other stamps; NaN before the first."""
    latest = np.searchsorted(stamps, at, side="right") - 1
    return np.where((latest >= 0)[:, None], values[np.maximum(latest, 0)], np.nan)


def _command_lag(recording: Recording) -> list[Found]:
    """Delay at which commands correlate best with measured speeds; log time on both sides."""
    commands, poses = recording.commands, recording.poses
    if commands is None:
        return []
    found = []
    measured = poses.twists
    for axis, name in enumerate(("speed", "turn rate")):
        scores = []
        for lag in _LAGS_S:
            earlier = poses.stamps_ns - np.int64(lag * 1e9)
            commanded = _held(commands.stamps_ns, commands.commands, earlier)[:, axis]
            usable = np.isfinite(commanded) & np.isfinite(measured[:, axis])
            pair = np.vstack((commanded[usable], measured[usable, axis]))
            varies = pair.shape[1] > 50 and np.std(pair[0]) > 0.02
            scores.append(float(np.corrcoef(pair)[0, 1]) if varies else 0.0)
        best = int(np.argmax(scores))
        if scores[best] > _LEAST_CORRELATION:
            found.append((f"command lag, {name}", "s", len(measured), float(_LAGS_S[best])))
    return found


def _message_lag(path: Path, scratch: Path) -> list[Found]:
    """Time from a message's stamp to its recording, where both clocks agree."""
    lags: dict[str, list[float]] = {}
    limits = DecoderLimits()
    with open_recording(_copy(path, scratch), limits=limits, workdir=scratch) as recording:
        kinds = {c.topic: c.msgtype for c in recording.connections}
        topics = frozenset(t for t, kind in kinds.items() if kind in (LASER_SCAN, ODOMETRY))
        layout = ("<4x2I", 0) if recording.ros_version == 1 else ("<2I", 4)
        for connection, stamp_ns, content in recording.messages(topics):
            second, nanosecond = struct.unpack_from(layout[0], content, layout[1])
            lag = (stamp_ns - second * 10**9 - nanosecond) / 1e9
            lags.setdefault(connection.topic, []).append(lag)
    return [
        (f"log time after stamp, {topic}", "s", len(found), np.median(found))
        for topic, found in sorted(lags.items())
        if abs(np.median(found)) < _SANE_CLOCK_S
    ]
