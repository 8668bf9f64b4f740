"""What a robot records, as serialized messages: one table of bytes per topic."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ses_core.arrays import FloatArray, IntArray
from ses_core.extraction.recording import CommandStream, PoseStream, RecordedMap, ScanStream
from ses_core.geometry import Pose2D
from storage.message_layouts import (
    LASER_SCAN,
    OCCUPANCY_GRID,
    ODOMETRY,
    POSE_STAMPED,
    TRANSFORMS,
    TWIST,
    LayoutBuilder,
    Serialization,
)

MAP_FRAME = "map"
_ODOM_FRAME, _BASE_FRAME, _LASER_FRAME = "odom", "base_link", "laser"


@dataclass(frozen=True, slots=True, kw_only=True)
class BagContent:
    """What a robot leaves behind. The streams' stamps are log times, when it was recorded.

    Attributes:
        poses: Odometry: poses in the odometry frame and measured twists (NaN is written as 0).
        commands: `cmd_vel`, or None.
        scans: Laser scans as the laser saw them, its mount on the body among them, or None.
        map: Published once, latched, or None.
        map_to_odom: Where the odometry frame lies in the map: one pose for all times or one (K, 3)
            per odometry message, published with it; or None.
        goals: (G, 3) [m, m, rad] navigation goals, in the map where `map_to_odom` says where that
            is, else in the odometry frame; or None.
        goal_stamps_ns: (G,) [ns] when they were set.
        recorder_start_ns: When latched topics were recorded; by default with the first pose.
        pose_headers_ns: (K,) stamps in the odometry and its transforms; by default the log times.
        transform_stamps_ns: (K,) log times of the transforms; by default those of the odometry.
        scan_headers_ns: (S,) stamps in the scans; by default the log times.
        range_min: Shortest valid reading [m].
    """

    poses: PoseStream
    commands: CommandStream | None = None
    scans: ScanStream | None = None
    map: RecordedMap | None = None
    map_to_odom: Pose2D | FloatArray | None = None
    goals: FloatArray | None = None
    goal_stamps_ns: IntArray | None = None
    recorder_start_ns: int | None = None
    pose_headers_ns: IntArray | None = None
    transform_stamps_ns: IntArray | None = None
    scan_headers_ns: IntArray | None = None
    range_min: float = 0.0


@dataclass(frozen=True, slots=True)
class MessageStream:
    """One topic's messages: serialized rows (K,) at log times (K,) [ns]."""

    topic: str
    message_type: str
    stamps_ns: IntArray
    rows: NDArray[np.void]


def message_streams(content: BagContent, serialization: Serialization) -> Iterator[MessageStream]:
    """Serialize a content, topic by topic; transforms come as several streams of one topic."""
    poses = content.poses
    headers = _or(content.pose_headers_ns, poses.stamps_ns)
    transform_stamps = _or(content.transform_stamps_ns, poses.stamps_ns)
    start = poses.stamps_ns[:1]
    if content.recorder_start_ns is not None:
        start = np.array([content.recorder_start_ns], dtype=np.int64)
    if content.scans is not None:
        mount = content.scans.mount
        rows = _transform_rows(serialization, start, _pose_array(mount), _BASE_FRAME, _LASER_FRAME)
        yield MessageStream("/tf_static", TRANSFORMS, start, rows)
    if content.map is not None:
        yield map_stream(content.map, stamp_ns=int(start[0]), serialization=serialization)
    if content.map_to_odom is not None:
        found = content.map_to_odom
        corrections = _pose_array(found) if isinstance(found, Pose2D) else found
        corrections = np.broadcast_to(corrections, poses.poses.shape)
        rows = _transform_rows(serialization, headers, corrections, MAP_FRAME, _ODOM_FRAME)
        yield MessageStream("/tf", TRANSFORMS, transform_stamps, rows)
    rows = _transform_rows(serialization, headers, poses.poses, _ODOM_FRAME, _BASE_FRAME)
    yield MessageStream("/tf", TRANSFORMS, transform_stamps, rows)
    rows = _odometry_rows(serialization, headers, poses)
    yield MessageStream("/odom", ODOMETRY, poses.stamps_ns, rows)
    if content.commands is not None:
        rows = _twist_rows(serialization, content.commands.commands)
        yield MessageStream("/cmd_vel", TWIST, content.commands.stamps_ns, rows)
    if content.scans is not None:
        scan_headers = _or(content.scan_headers_ns, content.scans.stamps_ns)
        rows = _scan_rows(serialization, scan_headers, content.scans, content.range_min)
        yield MessageStream("/scan", LASER_SCAN, content.scans.stamps_ns, rows)
    if content.goals is not None and content.goal_stamps_ns is not None:
        topic = "/move_base_simple/goal" if serialization == "ros1" else "/goal_pose"
        frame = _ODOM_FRAME if content.map_to_odom is None else MAP_FRAME
        rows = _goal_rows(serialization, content.goal_stamps_ns, content.goals, frame)
        yield MessageStream(topic, POSE_STAMPED, content.goal_stamps_ns, rows)


def map_stream(
    recorded: RecordedMap, *, stamp_ns: int, serialization: Serialization
) -> MessageStream:
    """Serialize a map, published once, in the frame `map`."""
    stamps = np.array([stamp_ns], dtype=np.int64)
    return MessageStream("/map", OCCUPANCY_GRID, stamps, _map_rows(serialization, stamps, recorded))


def _or(given: IntArray | None, default: IntArray) -> IntArray:
    return default if given is None else given


def _odometry_rows(
    serialization: Serialization, headers: IntArray, stream: PoseStream
) -> NDArray[np.void]:
    layout = LayoutBuilder(serialization)
    layout.add_header(_ODOM_FRAME)
    layout.add_string("child", _BASE_FRAME)
    layout.add("position", "f8", 3)
    layout.add("orientation", "f8", 4)
    layout.add("pose_covariance", "f8", 36)
    layout.add("linear", "f8", 3)
    layout.add("angular", "f8", 3)
    layout.add("twist_covariance", "f8", 36)
    rows = _stamped(layout, headers)
    _set_poses(rows, stream.poses)
    twists = np.nan_to_num(stream.twists)
    rows["linear"][:, 0] = twists[:, 0]
    rows["angular"][:, 2] = twists[:, 1]
    return rows


def _twist_rows(serialization: Serialization, commands: FloatArray) -> NDArray[np.void]:
    layout = LayoutBuilder(serialization)
    layout.add("linear", "f8", 3)
    layout.add("angular", "f8", 3)
    rows = layout.rows(len(commands))
    rows["linear"][:, 0] = commands[:, 0]
    rows["angular"][:, 2] = commands[:, 1]
    return rows


def _scan_rows(
    serialization: Serialization, headers: IntArray, scans: ScanStream, range_min: float
) -> NDArray[np.void]:
    beams = len(scans.angles)
    increment = (scans.angles[-1] - scans.angles[0]) / max(beams - 1, 1)
    layout = LayoutBuilder(serialization)
    layout.add_header(_LASER_FRAME)
    layout.add_constant("angle_min", "f4", scans.angles[0])
    layout.add_constant("angle_max", "f4", scans.angles[-1])
    layout.add_constant("angle_increment", "f4", increment)
    layout.add_constant("time_increment", "f4", 0.0)
    layout.add_constant("scan_time", "f4", _median_interval(headers))
    layout.add_constant("range_min", "f4", range_min)
    layout.add_constant("range_max", "f4", scans.range_max)
    layout.add_constant("ranges_length", "u4", beams)
    layout.add("ranges", "f4", beams)
    layout.add_constant("intensities_length", "u4", 0)
    rows = _stamped(layout, headers)
    rows["ranges"] = scans.ranges
    return rows


def _transform_rows(
    serialization: Serialization, stamps: IntArray, poses: FloatArray, parent: str, child: str
) -> NDArray[np.void]:
    layout = LayoutBuilder(serialization)
    layout.add_constant("transforms_length", "u4", 1)
    layout.add_header(parent)
    layout.add_string("child", child)
    layout.add("position", "f8", 3)
    layout.add("orientation", "f8", 4)
    rows = _stamped(layout, stamps)
    _set_poses(rows, poses)
    return rows


def _goal_rows(
    serialization: Serialization, stamps: IntArray, goals: FloatArray, frame: str
) -> NDArray[np.void]:
    layout = LayoutBuilder(serialization)
    layout.add_header(frame)
    layout.add("position", "f8", 3)
    layout.add("orientation", "f8", 4)
    rows = _stamped(layout, stamps)
    _set_poses(rows, goals)
    return rows


def _map_rows(
    serialization: Serialization, stamps: IntArray, recorded: RecordedMap
) -> NDArray[np.void]:
    height, width = recorded.cells.shape
    layout = LayoutBuilder(serialization)
    layout.add_header(MAP_FRAME)
    layout.add("load_sec", "u4")
    layout.add("load_nanosec", "u4")
    layout.add_constant("resolution", "f4", recorded.resolution)
    layout.add_constant("width", "u4", width)
    layout.add_constant("height", "u4", height)
    layout.add("position", "f8", 3)
    layout.add("orientation", "f8", 4)
    layout.add_constant("data_length", "u4", height * width)
    layout.add("data", "i1", height * width)
    rows = _stamped(layout, stamps)
    _set_poses(rows, _pose_array(recorded.origin))
    rows["data"] = np.array([0, 100, -1], dtype=np.int8)[recorded.cells].ravel()
    return rows


def _stamped(layout: LayoutBuilder, stamps: IntArray) -> NDArray[np.void]:
    rows = layout.rows(len(stamps))
    rows["sec"], rows["nanosec"] = np.divmod(stamps, 10**9)
    return rows


def _set_poses(rows: NDArray[np.void], poses: FloatArray) -> None:
    """Fill in positions and orientations from poses (K, 3) [m, m, rad]."""
    rows["position"][:, :2] = poses[:, :2]
    rows["orientation"][:, 2] = np.sin(poses[:, 2] / 2.0)
    rows["orientation"][:, 3] = np.cos(poses[:, 2] / 2.0)


def _median_interval(stamps: IntArray) -> float:
    return float(np.median(np.diff(stamps))) * 1e-9 if len(stamps) > 1 else 0.0


def _pose_array(pose: Pose2D) -> FloatArray:
    return np.array([[pose.x, pose.y, pose.yaw]])
