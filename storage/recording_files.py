"""A `Recording` as plain files: what the limited process hands over, and how that is checked."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ses_core.errors import LogError
from ses_core.extraction.recording import (
    CommandStream,
    PoseStream,
    RecordedMap,
    Recording,
    ScanStream,
)
from ses_core.extraction.stream_cleaning import YEAR_2100_NS
from ses_core.extraction.tabled_drives import TabledLog
from ses_core.geometry import Pose2D

_HEADER = "recording.json"
_HEADER_LIMIT = 2**20
_WARNING_LIMIT = 100
_STEP_LIMIT = 2**53
_SCALARS = {"int64": np.int64, "float64": np.float64, "float32": np.float32, "uint8": np.uint8}


def write_recording(directory: Path, recording: Recording) -> None:
    """Write a recording as one `.npy` file per array and a header."""
    arrays: dict[str, NDArray[Any]] = {
        "pose_stamps": recording.poses.stamps_ns,
        "poses": recording.poses.poses,
        "twists": recording.poses.twists,
    }
    header: dict[str, object] = {
        "pose_source": recording.pose_source,
        "has_clock": recording.has_clock,
        "messages_in": recording.messages_in,
        "messages_used": recording.messages_used,
        "warnings": recording.warnings,
    }
    if recording.commands is not None:
        arrays["command_stamps"] = recording.commands.stamps_ns
        arrays["commands"] = recording.commands.commands
    if recording.scans is not None:
        arrays["scan_stamps"] = recording.scans.stamps_ns
        arrays["ranges"] = recording.scans.ranges
        arrays["angles"] = recording.scans.angles
        header["range_max"] = recording.scans.range_max
        header["mount"] = _numbers(recording.scans.mount)
    if recording.map is not None:
        arrays["map_cells"] = recording.map.cells
        header["map_resolution"] = recording.map.resolution
        header["map_origin"] = _numbers(recording.map.origin)
    for name, array in arrays.items():
        np.save(directory / f"{name}.npy", array, allow_pickle=False)
    (directory / _HEADER).write_text(json.dumps(header), encoding="utf-8")


def read_recording(directory: Path, *, byte_limit: int) -> Recording:
    """Read a recording back, trusting nothing: sizes, shapes, types and values are checked.

    Arrays are mapped, not copied; the files may be deleted afterwards.

    Raises:
        LogError: `decoder_bug`: it is not what `write_recording` writes.
    """
    try:
        return _Files(directory, byte_limit).recording()
    except (OSError, ValueError, KeyError, TypeError, EOFError) as error:
        raise LogError("decoder_bug", f"decoded log cannot be used: {error}") from error


def write_recorded_map(directory: Path, recorded: RecordedMap) -> None:
    """Write a log's map alone."""
    header = {
        "map_resolution": recorded.resolution,
        "map_origin": _numbers(recorded.origin),
        "warnings": {},
    }
    np.save(directory / "map_cells.npy", recorded.cells, allow_pickle=False)
    (directory / _HEADER).write_text(json.dumps(header), encoding="utf-8")


def read_recorded_map(directory: Path, *, byte_limit: int) -> RecordedMap:
    """Read a map back, trusting as little as `read_recording`; the cells are copied.

    Raises:
        LogError: `decoder_bug`: it is not what `write_recorded_map` writes.
    """
    try:
        recorded = _Files(directory, byte_limit).recorded_map()
    except (OSError, ValueError, KeyError, TypeError, EOFError) as error:
        raise LogError("decoder_bug", f"decoded map cannot be used: {error}") from error
    return RecordedMap(
        cells=recorded.cells.copy(), resolution=recorded.resolution, origin=recorded.origin
    )


def write_tabled_log(directory: Path, log: TabledLog) -> None:
    """Write a log that came as tables: its recording, and where its drives begin and end."""
    write_recording(directory, log.recording)
    for name, array in (
        ("first_steps", log.first_steps),
        ("lengths", log.lengths),
        ("scan_poses", log.scan_poses),
    ):
        np.save(directory / f"{name}.npy", array, allow_pickle=False)


def read_tabled_log_back(directory: Path, *, byte_limit: int) -> TabledLog:
    """Read a log that came as tables back; see `read_recording`."""
    recording = read_recording(directory, byte_limit=byte_limit)
    try:
        return _Files(directory, byte_limit).tabled_log(recording)
    except (OSError, ValueError, KeyError, TypeError, EOFError) as error:
        raise LogError("decoder_bug", f"decoded log cannot be used: {error}") from error


@dataclass(frozen=True, slots=True)
class _Files:
    directory: Path
    byte_limit: int

    def recording(self) -> Recording:
        header = self._header()
        poses = PoseStream(
            stamps_ns=self._stamps("pose_stamps"),
            poses=self._array("poses", "float64", (None, 3)),
            twists=self._array("twists", "float64", (None, 2)),
        )
        _require(len(poses.stamps_ns) > 0, "there are no poses")
        _require(len(poses.stamps_ns) == len(poses.poses) == len(poses.twists), "uneven poses")
        _require(bool(np.isfinite(poses.poses).all()), "poses are not finite")
        warnings = header["warnings"]
        _require(len(warnings) <= _WARNING_LIMIT, "too many kinds of warnings")
        return Recording(
            poses=poses,
            commands=self._commands(),
            scans=self._scans(header),
            map=self._map(header),
            pose_source=str(header["pose_source"])[:16],
            has_clock=bool(header["has_clock"]),
            messages_in=int(header["messages_in"]),
            messages_used=int(header["messages_used"]),
            warnings={str(name)[:40]: int(count) for name, count in sorted(warnings.items())},
        )

    def recorded_map(self) -> RecordedMap:
        recorded = self._map(self._header())
        if recorded is None:
            raise ValueError("there is no map")
        return recorded

    def tabled_log(self, recording: Recording) -> TabledLog:
        first_steps = self._array("first_steps", "int64", (None,))
        lengths = self._array("lengths", "int64", (None,))
        scan_poses = self._array("scan_poses", "float64", (None, 3))
        scans = 0 if recording.scans is None else len(recording.scans.stamps_ns)
        total = len(recording.poses.stamps_ns)
        _require(len(first_steps) == len(lengths) > 0, "uneven drives")
        _require(bool(np.all(lengths > 0)) and int(lengths.sum()) == total, "uneven drives")
        _require(first_steps[0] >= 0 and first_steps[-1] < _STEP_LIMIT, "bad step numbers")
        ascends = bool(np.all(first_steps[1:] > first_steps[:-1]))
        _require(ascends and bool(np.all(np.diff(first_steps) >= lengths[:-1])), "drives overlap")
        _require(len(scan_poses) == scans, "uneven scan poses")
        _require(bool(np.isfinite(scan_poses).all()), "scan poses are not finite")
        return TabledLog(
            recording=recording, first_steps=first_steps, lengths=lengths, scan_poses=scan_poses
        )

    def _header(self) -> dict[str, Any]:
        sizes = [path.stat().st_size for path in self.directory.iterdir() if path.is_file()]
        _require(sum(sizes) <= self.byte_limit, f"it exceeds {self.byte_limit} bytes")
        path = self.directory / _HEADER
        _require(path.stat().st_size <= _HEADER_LIMIT, "its header is too long")
        header = json.loads(path.read_text(encoding="utf-8"))
        _require(isinstance(header, dict) and isinstance(header["warnings"], dict), "bad header")
        return dict(header)

    def _commands(self) -> CommandStream | None:
        if not (self.directory / "commands.npy").exists():
            return None
        stamps = self._stamps("command_stamps")
        commands = self._array("commands", "float64", (None, 2))
        _require(len(stamps) == len(commands), "uneven commands")
        return CommandStream(stamps_ns=stamps, commands=commands)

    def _scans(self, header: dict[str, Any]) -> ScanStream | None:
        if not (self.directory / "ranges.npy").exists():
            return None
        stamps = self._stamps("scan_stamps")
        ranges = self._array("ranges", "float32", (None, None))
        angles = self._array("angles", "float64", (None,))
        range_max = float(header["range_max"])
        _require(ranges.shape == (len(stamps), len(angles)), "uneven scans")
        _require(bool(np.isfinite(angles).all()) and range_max > 0.0, "bad scan geometry")
        mount = _pose(header["mount"])
        return ScanStream(
            stamps_ns=stamps, ranges=ranges, angles=angles, range_max=range_max, mount=mount
        )

    def _map(self, header: dict[str, Any]) -> RecordedMap | None:
        if not (self.directory / "map_cells.npy").exists():
            return None
        resolution = float(header["map_resolution"])
        _require(0.0 < resolution < np.inf, "bad map resolution")
        cells = self._array("map_cells", "uint8", (None, None))
        return RecordedMap(cells=cells, resolution=resolution, origin=_pose(header["map_origin"]))

    def _stamps(self, name: str) -> NDArray[Any]:
        stamps = self._array(name, "int64", (None,))
        # Compared, not subtracted: a difference of whole numbers wraps around.
        _require(bool(np.all(stamps[1:] >= stamps[:-1])), f"{name} go backwards")
        in_range = not len(stamps) or (stamps[0] >= 0 and stamps[-1] < YEAR_2100_NS)
        _require(bool(in_range), f"{name} are not between 1970 and 2100")
        return stamps

    def _array(self, name: str, dtype: str, shape: tuple[int | None, ...]) -> NDArray[Any]:
        array = np.load(self.directory / f"{name}.npy", mmap_mode="r", allow_pickle=False)
        expected = array.dtype == _SCALARS[dtype] and len(array.shape) == len(shape)
        sizes = zip(array.shape, shape, strict=False)
        _require(
            expected and all(wanted in (None, found) for found, wanted in sizes),
            f"{name} has {array.dtype} {array.shape}, expected {dtype} {shape}",
        )
        return np.asarray(array)


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


def _numbers(pose: Pose2D) -> list[float]:
    return [pose.x, pose.y, pose.yaw]


def _pose(numbers: list[float]) -> Pose2D:
    x, y, yaw = (float(number) for number in numbers)
    _require(bool(np.isfinite((x, y, yaw)).all()), "a pose is not finite")
    return Pose2D(x, y, yaw)
