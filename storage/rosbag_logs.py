"""`RosbagLogReader`: ROS 1 and ROS 2 recordings of any container to a `Recording`."""

import struct
from dataclasses import dataclass, field
from pathlib import Path

from ses_core.errors import LogError
from ses_core.extraction.recording import RecordedMap, Recording
from ses_core.robot_profile import GENERIC, RobotProfile
from ses_core.settings import DecoderLimits
from storage.collected_streams import CollectedStreams
from storage.message_decoding import (
    KNOWN_TYPES,
    MessageCursor,
    decode_grid,
    decode_odometry,
    decode_pose,
    decode_scan,
    decode_transforms,
    decode_twist,
)
from storage.message_types import require_known_definition, ros1_types, ros2_types
from storage.recording_assembly import assemble_map, assemble_recording
from storage.rosbag_containers import Message, OpenRecording, open_recording
from storage.topic_choice import TopicChoice, choose_topics


@dataclass(frozen=True, slots=True)
class RosbagLogReader:
    """Reads `.bag`, `.db3` and `.mcap` files and ROS 2 folders; only in the limited process.

    Attributes:
        limits: Caps on sizes.
        workdir: Empty folder for what has to be inflated.
    """

    limits: DecoderLimits
    workdir: Path

    def read(self, log: Path, *, profile: RobotProfile, pose_source: str) -> Recording:
        """Decode a recording.

        Raises:
            LogError: It cannot be used.
        """
        with open_recording(log, limits=self.limits, workdir=self.workdir) as recording:
            choice = choose_topics(recording.connections, profile, pose_source=pose_source)
            if choice.odometry is None and not choice.transforms:
                raise LogError(
                    "missing_topic", "log has neither odometry nor transforms: nothing says a pose"
                )
            _require_known(recording, choice)
            streams = _collect(recording, choice, output_limit=self.limits.output_mib * 2**20)
        return assemble_recording(streams, profile=profile, pose_source=pose_source)


def read_recorded_map(log: Path, *, limits: DecoderLimits, workdir: Path) -> RecordedMap:
    """Decode the latest map of a recording and nothing else; only in the limited process.

    Raises:
        LogError: It cannot be used; `missing_topic`: it has no map.
    """
    with open_recording(log, limits=limits, workdir=workdir) as recording:
        everything = choose_topics(recording.connections, GENERIC, pose_source="odometry")
        if everything.map is None:
            raise LogError("missing_topic", "log has no nav_msgs/OccupancyGrid")
        choice = TopicChoice(
            scan=None,
            odometry=None,
            command=None,
            pose=None,
            map=everything.map,
            transforms=frozenset(),
            static_transforms=frozenset(),
        )
        _require_known(recording, choice)
        streams = _collect(recording, choice, output_limit=limits.output_mib * 2**20)
    recorded = assemble_map(streams)
    if recorded is None:
        raise LogError("bad_values", f"map on {choice.map!r} is empty or has no usable frame")
    return recorded


def _require_known(recording: OpenRecording, choice: TopicChoice) -> None:
    types = ros1_types() if recording.ros_version == 1 else ros2_types()
    topics = choice.topics()
    for connection in recording.connections:
        if connection.topic in topics and connection.msgtype in KNOWN_TYPES:
            require_known_definition(connection, types, ros_version=recording.ros_version)


def _collect(
    recording: OpenRecording, choice: TopicChoice, *, output_limit: int
) -> CollectedStreams:
    """Decode the chosen topics message by message."""
    collector = _Collector(choice, output_limit=output_limit)
    is_ros1 = recording.ros_version == 1
    types = {
        (connection.topic, connection.msgtype)
        for connection in recording.connections
        if connection.msgtype in KNOWN_TYPES
    }
    for message in recording.messages(choice.topics()):
        collector.streams.messages_in += 1
        if (message.topic, message.message_type) not in types:
            collector.streams.warnings["dropped_other_type"] += 1
            continue
        try:
            collector.take(message, MessageCursor(message.content, is_ros1=is_ros1))
        except (struct.error, ValueError, OverflowError):
            collector.streams.warnings["dropped_malformed"] += 1
    streams = collector.streams
    streams.warnings.update(recording.warnings)
    malformed = streams.warnings["dropped_malformed"]
    if 2 * malformed > streams.messages_in:
        raise LogError(
            "schema_conflict",
            f"{malformed} of {streams.messages_in} messages do not have their type's form",
        )
    return streams


@dataclass(slots=True)
class _Collector:
    """Sorts decoded messages into streams."""

    choice: TopicChoice
    output_limit: int
    streams: CollectedStreams = field(default_factory=CollectedStreams)
    _bytes: int = 0

    def take(self, message: Message, cursor: MessageCursor) -> None:
        self._bytes += len(message.content)
        if self._bytes > self.output_limit:
            raise LogError("memory_limit", f"messages exceed {self.output_limit} bytes")
        streams, choice, stamp = self.streams, self.choice, message.stamp_ns
        if message.topic == choice.scan:
            streams.scans.append((stamp, decode_scan(cursor)))
        elif message.topic == choice.odometry:
            streams.odometry.append((stamp, decode_odometry(cursor)))
        elif message.topic == choice.command:
            streams.commands.append((stamp, decode_twist(cursor, message.message_type)))
        elif message.topic == choice.pose:
            streams.poses.append((stamp, decode_pose(cursor)))
        elif message.topic == choice.map:
            streams.warnings["dropped_older_map"] += streams.map is not None
            streams.map = decode_grid(cursor)
        else:
            is_static = message.topic in choice.static_transforms
            for transform in decode_transforms(cursor):
                streams.add_transform(stamp, transform, is_static=is_static)
            streams.transform_messages += 1
