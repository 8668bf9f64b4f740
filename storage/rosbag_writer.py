"""Writing real bags, ROS 1 files and ROS 2 folders, for fleets that we simulate."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from rosbags import rosbag1, rosbag2
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

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
from storage.message_types import ros1_types, ros2_types

BagFormat = Literal["mcap", "db3", "bag"]
BagCompression = Literal["none", "file", "message", "storage", "lz4", "bz2"]

MAP_FRAME = "map"
_ODOM_FRAME, _BASE_FRAME, _LASER_FRAME = "odom", "base_link", "laser"

_LATCHED_TOPICS = frozenset({"/tf_static", "/map", "/path", "/markers"})
"""Published once: whoever plays the bag back must keep them for those who listen later."""

_FOREVER = QosTime(9223372036, 854775807)
_LATCHED = (
    Qos(
        history=QosHistory.KEEP_LAST,
        depth=1,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL,
        deadline=_FOREVER,
        lifespan=_FOREVER,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=_FOREVER,
        avoid_ros_namespace_conventions=False,
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class BagContent:
    """What one deployment of a robot leaves behind.

    Attributes:
        poses: Odometry: poses in the odometry frame and measured twists (NaN is written as 0).
        commands: `cmd_vel`, or None.
        scans: Laser scans as the laser saw them, its mount on the body among them, or None.
        map: Published once at the first stamp, or None.
        map_to_odom: Where the odometry frame lies in the map, published with every pose, or None.
        goals: (G, 3) [m, m, rad] navigation goals in the odometry frame, or None.
        goal_stamps_ns: (G,) [ns] when they were set.
    """

    poses: PoseStream
    commands: CommandStream | None = None
    scans: ScanStream | None = None
    map: RecordedMap | None = None
    map_to_odom: Pose2D | None = None
    goals: FloatArray | None = None
    goal_stamps_ns: IntArray | None = None


@dataclass(frozen=True, slots=True)
class MessageStream:
    """One topic's messages: serialized rows (K,) at stamps (K,) [ns]."""

    topic: str
    message_type: str
    stamps_ns: IntArray
    rows: NDArray[np.void]


def write_rosbag(
    path: Path,
    content: BagContent,
    *,
    format: BagFormat,  # noqa: A002 - the contract's word
    compression: BagCompression = "none",
) -> None:
    """Write a bag; equal content gives equal bytes.

    Args:
        path: File to write for `bag`, folder for `mcap` and `db3`; must not exist.
        content: What the bag says.
        format: Container; `bag` is ROS 1, the others ROS 2.
        compression: `file`, `message`, `storage` (MCAP chunks) for ROS 2; `lz4`, `bz2` for ROS 1.
    """
    if format == "bag":
        _write_ros1(path, list(message_streams(content, "ros1")), compression)
    else:
        write_ros2(path, list(message_streams(content, "cdr")), format, compression)


def _write_ros1(path: Path, streams: Sequence[MessageStream], compression: BagCompression) -> None:
    writer = rosbag1.Writer(path)
    if compression != "none":
        writer.set_compression(rosbag1.Writer.CompressionFormat[compression.upper()])
    with writer:
        connections = {
            topic: writer.add_connection(topic, message_type, typestore=ros1_types())
            for topic, message_type in _topics(streams).items()
        }
        for topic, stamp, message in _in_time_order(streams):
            writer.write(connections[topic], stamp, message)


def write_ros2(
    path: Path, streams: Sequence[MessageStream], storage: BagFormat, compression: BagCompression
) -> None:
    """Write streams of CDR messages as a ROS 2 bag: a folder that must not exist."""
    plugin = rosbag2.StoragePlugin.MCAP if storage == "mcap" else rosbag2.StoragePlugin.SQLITE3
    writer = rosbag2.Writer(path, version=9, storage_plugin=plugin)
    if compression != "none":
        mode = rosbag2.CompressionMode[compression.upper()]
        writer.set_compression(mode, rosbag2.CompressionFormat.ZSTD)
    with writer:
        connections = {
            topic: writer.add_connection(
                topic,
                message_type,
                typestore=ros2_types(),
                offered_qos_profiles=_LATCHED if topic in _LATCHED_TOPICS else (),
            )
            for topic, message_type in _topics(streams).items()
        }
        for topic, stamp, message in _in_time_order(streams):
            writer.write(connections[topic], stamp, message)


def _topics(streams: Sequence[MessageStream]) -> dict[str, str]:
    """Give each topic's message type; several streams may share one topic."""
    return {stream.topic: stream.message_type for stream in streams}


def _in_time_order(streams: Sequence[MessageStream]) -> Iterator[tuple[str, int, bytes]]:
    """Give (topic, stamp [ns], message) in order of time, earlier streams first when tied."""
    stamps = np.concatenate([stream.stamps_ns for stream in streams])
    owners = np.repeat(np.arange(len(streams)), [len(stream.stamps_ns) for stream in streams])
    rows = np.concatenate([np.arange(len(stream.stamps_ns)) for stream in streams])
    for index in np.argsort(stamps, kind="stable").tolist():
        stream = streams[owners[index]]
        yield stream.topic, int(stamps[index]), stream.rows[rows[index]].tobytes()


def message_streams(content: BagContent, serialization: Serialization) -> Iterator[MessageStream]:
    """Serialize everything a bag says, topic by topic."""
    start = content.poses.stamps_ns[:1]
    if content.scans is not None:
        mount = content.scans.mount
        rows = _transform_rows(serialization, start, _pose_array(mount), _BASE_FRAME, _LASER_FRAME)
        yield MessageStream("/tf_static", TRANSFORMS, start, rows)
    if content.map is not None:
        yield map_stream(content.map, stamp_ns=int(start[0]), serialization=serialization)
    if content.map_to_odom is not None:
        stamps = content.poses.stamps_ns
        poses = np.repeat(_pose_array(content.map_to_odom), len(stamps), axis=0)
        rows = _transform_rows(serialization, stamps, poses, MAP_FRAME, _ODOM_FRAME)
        yield MessageStream("/tf", TRANSFORMS, stamps, rows)
    rows = _transform_rows(
        serialization, content.poses.stamps_ns, content.poses.poses, _ODOM_FRAME, _BASE_FRAME
    )
    yield MessageStream("/tf", TRANSFORMS, content.poses.stamps_ns, rows)
    yield MessageStream(
        "/odom", ODOMETRY, content.poses.stamps_ns, _odometry_rows(serialization, content.poses)
    )
    if content.commands is not None:
        stamps, commands = content.commands.stamps_ns, content.commands.commands
        yield MessageStream("/cmd_vel", TWIST, stamps, _twist_rows(serialization, commands))
    if content.scans is not None:
        rows = _scan_rows(serialization, content.scans)
        yield MessageStream("/scan", LASER_SCAN, content.scans.stamps_ns, rows)
    if content.goals is not None and content.goal_stamps_ns is not None:
        topic = "/move_base_simple/goal" if serialization == "ros1" else "/goal_pose"
        stamps = content.goal_stamps_ns
        yield MessageStream(
            topic, POSE_STAMPED, stamps, _goal_rows(serialization, stamps, content.goals)
        )


def map_stream(
    recorded: RecordedMap, *, stamp_ns: int, serialization: Serialization
) -> MessageStream:
    """Serialize a map, published once, in the frame `map`."""
    stamps = np.array([stamp_ns], dtype=np.int64)
    return MessageStream("/map", OCCUPANCY_GRID, stamps, _map_rows(serialization, stamps, recorded))


def _odometry_rows(serialization: Serialization, stream: PoseStream) -> NDArray[np.void]:
    layout = LayoutBuilder(serialization)
    layout.add_header(_ODOM_FRAME)
    layout.add_string("child", _BASE_FRAME)
    layout.add("position", "f8", 3)
    layout.add("orientation", "f8", 4)
    layout.add("pose_covariance", "f8", 36)
    layout.add("linear", "f8", 3)
    layout.add("angular", "f8", 3)
    layout.add("twist_covariance", "f8", 36)
    rows = _stamped(layout, stream.stamps_ns)
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


def _scan_rows(serialization: Serialization, scans: ScanStream) -> NDArray[np.void]:
    beams = len(scans.angles)
    increment = (scans.angles[-1] - scans.angles[0]) / max(beams - 1, 1)
    layout = LayoutBuilder(serialization)
    layout.add_header(_LASER_FRAME)
    layout.add_constant("angle_min", "f4", scans.angles[0])
    layout.add_constant("angle_max", "f4", scans.angles[-1])
    layout.add_constant("angle_increment", "f4", increment)
    layout.add_constant("time_increment", "f4", 0.0)
    layout.add_constant("scan_time", "f4", 0.0)
    layout.add_constant("range_min", "f4", 0.0)
    layout.add_constant("range_max", "f4", scans.range_max)
    layout.add_constant("ranges_length", "u4", beams)
    layout.add("ranges", "f4", beams)
    layout.add_constant("intensities_length", "u4", 0)
    rows = _stamped(layout, scans.stamps_ns)
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
    serialization: Serialization, stamps: IntArray, goals: FloatArray
) -> NDArray[np.void]:
    layout = LayoutBuilder(serialization)
    layout.add_header(_ODOM_FRAME)
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


def _pose_array(pose: Pose2D) -> FloatArray:
    return np.array([[pose.x, pose.y, pose.yaw]])
