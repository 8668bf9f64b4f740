"""Logs that come as tables: `logs`, `trajectories`, `scans` and a map, from outside.

`ses deploy --format tables` writes them. They are trusted as little as bags: read here in the
limited process, every value checked, and what can be worked out is not taken from them.
"""

import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ses_core.arrays import FloatArray, IntArray
from ses_core.errors import LogError
from ses_core.extraction.recording import (
    CommandStream,
    PoseStream,
    RecordedMap,
    Recording,
    ScanStream,
)
from ses_core.extraction.stream_cleaning import YEAR_2100_NS, returns_only, usable_poses
from ses_core.extraction.tabled_drives import TabledLog
from ses_core.geometry import Pose2D
from ses_core.settings import DecoderLimits
from storage.bounded_parquet import read_bounded
from storage.log_formats import LOGS_FILE, MAP_FILE, SCANS_FILE, TRAJECTORIES_FILE

_LOG_COLUMNS = ("pose_source", "messages_in", "messages_used", "warnings", "has_clock")
_STEP_COLUMNS = (
    *("step", "stamp_ns", "x_m", "y_m", "yaw_rad"),
    *("command_v_mps", "command_w_radps", "measured_v_mps", "measured_w_radps"),
)
_GEOMETRY = (
    *("angle_min_rad", "angle_increment_rad", "range_max_m"),
    *("mount_x_m", "mount_y_m", "mount_yaw_rad"),
)
_SCAN_COLUMNS = ("stamp_ns", *_GEOMETRY, "ranges_m", "body_x_m", "body_y_m", "body_yaw_rad")
_WARNINGS_LIMIT = 100
_COUNT_LIMIT = 2**53
_BEAM_LIMIT = 100_000


def read_tabled_log(folder: Path, *, limits: DecoderLimits) -> TabledLog:
    """Read and check a folder of tables; run only inside the limited decoder process.

    Raises:
        LogError: It cannot be used.
    """
    limit = limits.output_mib * 2**20
    row = _log_row(folder, limit)
    steps = read_bounded(
        folder / TRAJECTORIES_FILE, "trajectories", _STEP_COLUMNS, byte_limit=limit
    )
    numbers, stamps = _whole(steps, "step"), _whole(steps, "stamp_ns")
    if not len(numbers):
        raise LogError("empty", "trajectories.parquet holds no step")
    if numbers[0] < 0 or numbers[-1] >= _COUNT_LIMIT or not _ascend(numbers):
        raise LogError("schema_conflict", "step numbers do not ascend from 0 on")
    _require_clock(stamps, "steps")
    poses = _real(steps, "x_m", "y_m", "yaw_rad")
    _require_poses(poses, "steps")
    scans, scan_poses = _scans(folder, limit)
    warnings = dict(row.warnings)
    if scans is None:
        warnings["no_scans"] = 1
    commands = _real(steps, "command_v_mps", "command_w_radps")
    starts = np.concatenate(([0], np.flatnonzero(np.diff(numbers) != 1) + 1))
    return TabledLog(
        recording=Recording(
            poses=PoseStream(
                stamps_ns=stamps,
                poses=poses,
                twists=_real(steps, "measured_v_mps", "measured_w_radps"),
            ),
            commands=CommandStream(stamps_ns=stamps, commands=commands)
            if np.isfinite(commands).any()
            else None,
            scans=scans,
            map=_map(folder, limit),
            pose_source=row.pose_source,
            has_clock=True,
            messages_in=row.messages_in,
            messages_used=row.messages_used,
            warnings=dict(sorted(warnings.items())),
        ),
        first_steps=numbers[starts],
        lengths=np.diff(np.append(starts, len(numbers))),
        scan_poses=scan_poses,
    )


@dataclass(frozen=True, slots=True)
class _LogRow:
    pose_source: str
    messages_in: int
    messages_used: int
    warnings: dict[str, int]


def _log_row(folder: Path, limit: int) -> _LogRow:
    rows = read_bounded(folder / LOGS_FILE, "logs", _LOG_COLUMNS, byte_limit=limit).to_pylist()
    if len(rows) != 1:
        raise LogError("schema_conflict", f"logs.parquet has {len(rows)} rows, expected one")
    row = rows[0]
    if row["has_clock"] is not True:
        raise LogError("bad_clock", "tables of a log without a clock cannot be taken in")
    if row["pose_source"] not in ("odometry", "map"):
        raise LogError("schema_conflict", "pose_source is neither odometry nor map")
    messages_in, messages_used = row["messages_in"], row["messages_used"]
    if not 0 <= messages_used <= messages_in < _COUNT_LIMIT:
        raise LogError(
            "schema_conflict", f"{messages_used} of {messages_in} messages cannot have been used"
        )
    try:
        found = json.loads(row["warnings"])
        warnings = {str(name): int(count) for name, count in found.items()}
        if len(warnings) > _WARNINGS_LIMIT or not all(
            0 <= count < _COUNT_LIMIT for count in warnings.values()
        ):
            raise ValueError("too many, or no counts")
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        raise LogError("schema_conflict", f"warnings are no counts by name: {error}") from error
    # The counters of cuts and scans are counted anew from the steps.
    own = {name: count for name, count in warnings.items() if name != "scans_not_kept"}
    return _LogRow(row["pose_source"], messages_in, messages_used, own)


def _scans(folder: Path, limit: int) -> tuple[ScanStream | None, FloatArray]:
    rows = read_bounded(folder / SCANS_FILE, "scans", _SCAN_COLUMNS, byte_limit=limit)
    if not rows.num_rows:
        return None, np.empty((0, 3))
    stamps = _whole(rows, "stamp_ns")
    _require_clock(stamps, "scans")
    geometry = _real(rows, *_GEOMETRY)
    if not np.isfinite(geometry).all() or np.any(geometry != geometry[0]):
        raise LogError("schema_conflict", "scans are not all of one laser in one place")
    angle_min, increment, range_max, *mount = geometry[0].tolist()
    if range_max <= 0.0 or increment == 0.0:
        raise LogError("bad_values", f"laser reaches {range_max} m in steps of {increment} rad")
    ranges = _equal_lists(rows.column("ranges_m").combine_chunks())
    bodies = _real(rows, "body_x_m", "body_y_m", "body_yaw_rad")
    _require_poses(bodies, "scans")
    stream = ScanStream(
        stamps_ns=stamps,
        ranges=returns_only(ranges, range_min=0.0, range_max=range_max),
        angles=angle_min + increment * np.arange(ranges.shape[1]),
        range_max=range_max,
        mount=Pose2D(*mount),
    )
    return stream, bodies


def _equal_lists(lists: pa.ListArray) -> "np.ndarray[tuple[int, int], np.dtype[np.float32]]":
    """Give lists of one length as rows (S, B)."""
    offsets = np.from_dlpack(lists.offsets)
    lengths = np.unique(np.diff(offsets))
    values = lists.values
    if lists.null_count or values.null_count or len(lengths) != 1:
        raise LogError("schema_conflict", "scans have different numbers of readings")
    if not 1 < lengths[0] <= _BEAM_LIMIT:
        raise LogError("bad_values", f"scans have {lengths[0]} readings, expected 2 or more")
    flat = np.from_dlpack(values)[offsets[0] : offsets[-1]]
    return flat.reshape(len(lists), int(lengths[0])).astype(np.float32, copy=False)


def _map(folder: Path, limit: int) -> RecordedMap | None:
    path = folder / MAP_FILE
    if not path.exists():
        return None
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(item.file_size for item in archive.infolist())
        if size > limit:
            raise LogError("decompress_bomb", f"map inflates to {size} bytes")
        with np.load(path, allow_pickle=False) as arrays:
            cells, resolution = arrays["cells"], float(arrays["resolution"])
            x, y, yaw = (float(number) for number in arrays["origin"])
        if cells.dtype != np.uint8 or cells.ndim != 2 or not cells.size or cells.max() > 2:
            raise ValueError(f"cells are {cells.dtype} {cells.shape}, expected 0, 1 or 2 in (H, W)")
        if not np.isfinite((resolution, x, y, yaw)).all() or resolution <= 0.0:
            raise ValueError("resolution or origin is no number")
    except (zipfile.BadZipFile, OSError, ValueError, KeyError, TypeError, EOFError) as error:
        raise LogError("schema_conflict", f"map.npz is no map: {error}") from error
    return RecordedMap(cells=cells, resolution=resolution, origin=Pose2D(x, y, yaw))


def _require_clock(stamps: IntArray, what: str) -> None:
    if stamps[0] < 0 or stamps[-1] >= YEAR_2100_NS or not _ascend(stamps):
        raise LogError("bad_clock", f"stamps of the {what} do not ascend between 1970 and 2100")


def _ascend(numbers: IntArray) -> bool:
    # Compared, not subtracted: a difference of whole numbers wraps around.
    return bool(np.all(numbers[1:] > numbers[:-1]))


def _require_poses(poses: FloatArray, what: str) -> None:
    unusable = int(np.count_nonzero(~usable_poses(poses)))
    if unusable:
        raise LogError(
            "bad_values",
            f"{unusable} of {len(poses)} poses of the {what} are not finite or out of reach",
        )


def _whole(rows: pa.Table, name: str) -> IntArray:
    return _numbers(rows, name).astype(np.int64)


def _real(rows: pa.Table, *names: str) -> FloatArray:
    """Give columns (K, N) of real numbers."""
    return np.column_stack([_numbers(rows, name) for name in names]).astype(np.float64, copy=False)


def _numbers(rows: pa.Table, name: str) -> NDArray[Any]:
    """Give a column (K,) as it lies in memory: Arrow's own way to numpy imports pandas first."""
    column = rows.column(name)
    if column.null_count:
        raise LogError("schema_conflict", f"there are nulls in {name}")
    return np.from_dlpack(column.combine_chunks())
