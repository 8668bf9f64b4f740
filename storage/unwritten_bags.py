"""A bag's content as its decoder would give it back, without the bag in between."""

from collections import Counter

import numpy as np
from rosbags.interfaces import Connection, MessageDefinition, MessageDefinitionFormat

from ses_core.extraction.recording import Recording
from ses_core.robot_profile import RobotProfile
from storage.bag_messages import BagContent, message_streams
from storage.recording_assembly import assemble_recording
from storage.stream_collection import StreamCollector
from storage.topic_choice import choose_topics


def recording_of(content: BagContent, *, profile: RobotProfile, pose_source: str) -> Recording:
    """Give what decoding a bag with this content gives, number for number.

    The messages are made and decoded as for a bag; only the container is left out.

    Raises:
        LogError: No bag with this content could be used.
    """
    streams = list(message_streams(content, "cdr"))
    counts: Counter[tuple[str, str]] = Counter()
    for stream in streams:
        counts[stream.topic, stream.message_type] += len(stream.stamps_ns)
    connections = [
        Connection(
            number,
            topic,
            message_type,
            MessageDefinition(MessageDefinitionFormat.NONE, ""),
            "",
            count,
            None,  # type: ignore[arg-type]  # what only containers know
            None,
        )
        for number, ((topic, message_type), count) in enumerate(counts.items())
    ]
    choice = choose_topics(connections, profile, pose_source=pose_source)
    collector = StreamCollector(choice, is_ros1=False)
    topics = choice.topics()
    for stream in streams:
        if stream.topic in topics and len(stream.rows):
            rows = stream.rows.view(np.uint8).reshape(len(stream.rows), -1)
            collector.take_rows(stream.topic, stream.message_type, stream.stamps_ns, rows)
    return assemble_recording(collector.streams, profile=profile, pose_source=pose_source)
