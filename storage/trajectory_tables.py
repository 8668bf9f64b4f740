"""What ingest leaves of a log: a row of `logs`, the steps of `trajectories`, the `scans`, a map."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np
import pandas as pd

from ses_core.arrays import FloatArray
from ses_core.errors import SchemaError
from ses_core.extraction.recording import RecordedMap, Recording, ScanStream
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import Pose2D, compose_all
from storage.log_formats import LOGS_FILE, MAP_FILE, SCANS_FILE, TRAJECTORIES_FILE
from storage.parquet_files import read_table, write_empty_table, write_table


@dataclass(frozen=True, slots=True, kw_only=True)
class LogDescription:
    """What is known of a log beside what it says.

    Attributes:
        name: File or folder name as uploaded.
        profile: Name of the robot profile it was decoded with.
        velocity_source: Which velocity counts: `commanded`, `measured` or `derived`.
    """

    log_id: str
    name: str
    robot: str
    site: str
    format: str
    batch_date: date
    profile: str
    velocity_source: str


def write_ingested(
    directory: Path,
    description: LogDescription,
    recording: Recording,
    trajectories: list[Trajectory],
    *,
    cut_counts: Mapping[str, int],
) -> None:
    """Write everything later stages need of one log.

    Args:
        directory: Empty folder, usually in the store's staging.
        description: Who recorded it, and how it was read.
        recording: The decoded log.
        trajectories: What `resample` made of it.
        cut_counts: How often `find_cuts` cut it, by cause.
    """
    kept = sum(len(item.scans.stamps_ns) for item in trajectories if item.scans is not None)
    warnings = {**recording.warnings, **cut_counts}
    if recording.scans is not None:
        warnings["scans_not_kept"] = len(recording.scans.stamps_ns) - kept
    warnings = {name: int(count) for name, count in sorted(warnings.items()) if count}
    _write_log_row(directory, description, recording, trajectories, warnings, kept)
    _write_steps(directory, description.log_id, trajectories)
    _write_scans(directory, description.log_id, trajectories)
    if recording.map is not None:
        origin = recording.map.origin
        np.savez_compressed(
            directory / MAP_FILE,
            cells=recording.map.cells,
            resolution=recording.map.resolution,
            origin=np.array([origin.x, origin.y, origin.yaw]),
        )


def read_log_row(directory: Path) -> dict[str, object]:
    """Read a log's row of `logs`, its warnings as a mapping."""
    row = read_table(directory / LOGS_FILE, "logs").iloc[0].to_dict()
    return {str(name): value for name, value in row.items()} | {
        "warnings": json.loads(str(row["warnings"]))
    }


def read_trajectories(directory: Path) -> list[Trajectory]:
    """Read back the trajectories of a log.

    Raises:
        SchemaError: The tables are not those that `write_ingested` writes.
    """
    has_clock = bool(read_table(directory / LOGS_FILE, "logs", ["has_clock"])["has_clock"].iloc[0])
    steps = read_table(directory / TRAJECTORIES_FILE, "trajectories")
    scans = read_table(directory / SCANS_FILE, "scans")
    scan_stamps = scans["stamp_ns"].to_numpy()
    trajectories: list[Trajectory] = []
    for _, drive in steps.groupby("drive", sort=True):
        stamps = drive["stamp_ns"].to_numpy(dtype=np.int64)
        first_step, last_step = int(drive["step"].iloc[0]), int(drive["step"].iloc[-1])
        if last_step - first_step + 1 != len(drive):
            raise SchemaError(f"{directory}: steps of a drive are not consecutive")
        own = scans["step"].between(first_step, last_step) if len(scan_stamps) else None
        stream, poses = (None, None) if own is None else _read_scans(scans[own])
        trajectories.append(
            Trajectory(
                first_step=first_step,
                stamps_ns=stamps,
                poses=_columns(drive, "x_m", "y_m", "yaw_rad"),
                commanded=_columns(drive, "command_v_mps", "command_w_radps"),
                measured=_columns(drive, "measured_v_mps", "measured_w_radps"),
                speed=drive["speed_mps"].to_numpy(dtype=np.float64),
                has_clock=has_clock,
                scans=stream,
                scan_poses=poses,
            )
        )
    return trajectories


def read_recorded_map(directory: Path) -> RecordedMap | None:
    """Read the map that the log brought along; None where it brought none."""
    path = directory / MAP_FILE
    if not path.exists():
        return None
    with np.load(path, allow_pickle=False) as arrays:
        x, y, yaw = (float(number) for number in arrays["origin"])
        return RecordedMap(
            cells=arrays["cells"], resolution=float(arrays["resolution"]), origin=Pose2D(x, y, yaw)
        )


def _write_log_row(
    directory: Path,
    description: LogDescription,
    recording: Recording,
    trajectories: list[Trajectory],
    warnings: Mapping[str, int],
    scan_count: int,
) -> None:
    stamps = recording.poses.stamps_ns
    length = sum(
        float(np.hypot(*np.diff(trajectory.poses[:, :2], axis=0).T).sum())
        for trajectory in trajectories
    )
    row: dict[str, list[object]] = {
        "log_id": [description.log_id],
        "name": [description.name],
        "robot": [description.robot],
        "site": [description.site],
        "pose_source": [recording.pose_source],
        "format": [description.format],
        "batch_date": [description.batch_date.isoformat()],
        "start_stamp_ns": [int(stamps[0])],
        "duration_s": [float(stamps[-1] - stamps[0]) * 1e-9],
        "path_length_m": [length],
        "steps": [sum(len(trajectory) for trajectory in trajectories)],
        "messages_in": [recording.messages_in],
        "messages_used": [recording.messages_used],
        "warnings": [json.dumps(dict(warnings), sort_keys=True)],
        "profile": [description.profile],
        "velocity_source": [description.velocity_source],
        "has_clock": [recording.has_clock],
        "scans": [scan_count],
    }
    write_table(directory / LOGS_FILE, "logs", row)


def _write_steps(directory: Path, log_id: str, trajectories: list[Trajectory]) -> None:
    lengths = [len(trajectory) for trajectory in trajectories]
    poses = _stacked([trajectory.poses for trajectory in trajectories], 3)
    commanded = _stacked([trajectory.commanded for trajectory in trajectories], 2)
    measured = _stacked([trajectory.measured for trajectory in trajectories], 2)
    speed = _stacked([trajectory.speed[:, None] for trajectory in trajectories], 1)[:, 0]
    steps = [trajectory.first_step + np.arange(len(trajectory)) for trajectory in trajectories]
    stamps = [trajectory.stamps_ns for trajectory in trajectories]
    negative = pd.array(speed < 0.0, dtype="boolean")
    negative[np.isnan(speed)] = pd.NA
    write_table(
        directory / TRAJECTORIES_FILE,
        "trajectories",
        {
            "log_id": [log_id] * sum(lengths),
            "step": np.concatenate(steps or [np.empty(0, np.int64)]),
            "stamp_ns": np.concatenate(stamps or [np.empty(0, np.int64)]),
            "x_m": poses[:, 0],
            "y_m": poses[:, 1],
            "yaw_rad": poses[:, 2],
            "command_v_mps": commanded[:, 0],
            "command_w_radps": commanded[:, 1],
            "measured_v_mps": measured[:, 0],
            "measured_w_radps": measured[:, 1],
            "speed_mps": speed,
            "negative_velocity": pd.Series(negative),
            "drive": np.repeat(np.arange(len(lengths)), lengths),
        },
    )


def _write_scans(directory: Path, log_id: str, trajectories: list[Trajectory]) -> None:
    """Write the scans of all drives; they share one geometry, being of one recording."""
    with_scans = [
        (trajectory, trajectory.scans, trajectory.scan_poses)
        for trajectory in trajectories
        if trajectory.scans is not None and trajectory.scan_poses is not None
    ]
    if not with_scans:
        write_empty_table(directory / SCANS_FILE, "scans")
        return
    laser = with_scans[0][1]
    bodies = np.concatenate([poses for _, _, poses in with_scans])
    sensors = compose_all(bodies, laser.mount)
    steps = [
        trajectory.first_step
        + np.searchsorted(trajectory.stamps_ns, scans.stamps_ns, side="right")
        - 1
        for trajectory, scans, _ in with_scans
    ]
    count = len(bodies)
    write_table(
        directory / SCANS_FILE,
        "scans",
        {
            "log_id": [log_id] * count,
            "scan": np.arange(count),
            "stamp_ns": np.concatenate([scans.stamps_ns for _, scans, _ in with_scans]),
            "step": np.concatenate(steps),
            "x_m": sensors[:, 0],
            "y_m": sensors[:, 1],
            "yaw_rad": sensors[:, 2],
            "angle_min_rad": np.full(count, laser.angles[0]),
            "angle_increment_rad": np.full(count, _increment(laser)),
            "range_max_m": np.full(count, laser.range_max),
            "ranges_m": np.concatenate([scans.ranges for _, scans, _ in with_scans]),
            "body_x_m": bodies[:, 0],
            "body_y_m": bodies[:, 1],
            "body_yaw_rad": bodies[:, 2],
            "mount_x_m": np.full(count, laser.mount.x),
            "mount_y_m": np.full(count, laser.mount.y),
            "mount_yaw_rad": np.full(count, laser.mount.yaw),
        },
    )


def _increment(laser: ScanStream) -> float:
    return float(laser.angles[-1] - laser.angles[0]) / (len(laser.angles) - 1)


def _read_scans(rows: pd.DataFrame) -> tuple[ScanStream | None, FloatArray | None]:
    if rows.empty:
        return None, None
    first = rows.iloc[0]
    beams = len(first["ranges_m"])
    angles = first["angle_min_rad"] + first["angle_increment_rad"] * np.arange(beams)
    stream = ScanStream(
        stamps_ns=rows["stamp_ns"].to_numpy(dtype=np.int64),
        ranges=np.stack(rows["ranges_m"].to_list()).astype(np.float32, copy=False),
        angles=np.asarray(angles, dtype=np.float64),
        range_max=float(first["range_max_m"]),
        mount=Pose2D(
            float(first["mount_x_m"]), float(first["mount_y_m"]), float(first["mount_yaw_rad"])
        ),
    )
    return stream, _columns(rows, "body_x_m", "body_y_m", "body_yaw_rad")


def _columns(rows: pd.DataFrame, *names: str) -> FloatArray:
    return rows[list(names)].to_numpy(dtype=np.float64)


def _stacked(blocks: list[FloatArray], width: int) -> FloatArray:
    return np.concatenate(blocks) if blocks else np.empty((0, width))
