"""`RosbagLogReader`: ROS 1 and ROS 2 recordings of any container to a `Recording`."""

from dataclasses import dataclass, field
from pathlib import Path

from ses_core.errors import LogError
from ses_core.extraction.recording import RecordedMap, Recording
from ses_core.robot_profile import GENERIC, RobotProfile
from ses_core.settings import DecoderLimits
from storage.collected_streams import CollectedStreams
from storage.message_decoding import KNOWN_TYPES
from storage.message_types import require_known_definition, ros1_types, ros2_types
from storage.recording_assembly import assemble_map, assemble_recording
from storage.rosbag_containers import OpenRecording, open_recording
from storage.stream_collection import StreamCollector
from storage.topic_choice import TopicChoice, choose_topics

_BATCH_BYTES = 4 * 2**20
_BATCH_MESSAGES = 8192
"""Messages of a topic are decoded together, this many at a time."""


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
            streams = collect_streams(
                recording, choice, output_limit=self.limits.output_mib * 2**20
            )
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
        streams = collect_streams(recording, choice, output_limit=limits.output_mib * 2**20)
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


def collect_streams(
    recording: OpenRecording, choice: TopicChoice, *, output_limit: int
) -> CollectedStreams:
    """Decode the messages of the chosen topics.

    Raises:
        LogError: They are too many, too large, or most do not have their type's form.
    """
    collector = StreamCollector(choice, is_ros1=recording.ros_version == 1)
    types = {
        (connection.topic, connection.msgtype)
        for connection in recording.connections
        if connection.msgtype in KNOWN_TYPES
    }
    pending: dict[tuple[str, str], _Pending] = {}
    total = 0
    for connection, stamp, content in recording.messages(choice.topics()):
        key = (connection.topic, connection.msgtype)
        waiting = pending.get(key)
        if waiting is None:
            waiting = pending[key] = _Pending()
        waiting.stamps.append(stamp)
        waiting.contents.append(content)
        waiting.bytes += len(content)
        if waiting.bytes > _BATCH_BYTES or len(waiting.stamps) >= _BATCH_MESSAGES:
            total += waiting.bytes
            _flush(collector, key, pending.pop(key), is_known=key in types)
        if total > output_limit:
            raise LogError("memory_limit", f"messages exceed {output_limit} bytes")
    for key, waiting in pending.items():
        _flush(collector, key, waiting, is_known=key in types)
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
class _Pending:
    """Messages of one topic that wait to be decoded together."""

    stamps: list[int] = field(default_factory=list)
    contents: list[bytes | memoryview] = field(default_factory=list)
    bytes: int = 0


def _flush(
    collector: StreamCollector, key: tuple[str, str], waiting: _Pending, *, is_known: bool
) -> None:
    if is_known:
        collector.take(*key, waiting.stamps, waiting.contents)
    else:
        collector.pass_over(len(waiting.stamps))
