"""`StreamCollector`: batches of messages, sorted by topic into decoded streams."""

from collections.abc import Sequence

import numpy as np

from ses_core.arrays import ByteArray, IntArray
from storage.collected_streams import CollectedStreams
from storage.message_decoding import (
    MessageBatch,
    batch_of,
    decode_grids,
    decode_odometry,
    decode_poses,
    decode_scans,
    decode_transforms,
    decode_twists,
)
from storage.topic_choice import TopicChoice

_LAST_STAMP = 2**63 - 1


class StreamCollector:
    """Collects `streams`; counts what it is given, and what of it cannot be used."""

    def __init__(self, choice: TopicChoice, *, is_ros1: bool) -> None:
        self._choice = choice
        self._is_ros1 = is_ros1
        self.streams = CollectedStreams()

    def take(
        self,
        topic: str,
        message_type: str,
        stamps: Sequence[int],
        contents: Sequence[bytes | memoryview],
    ) -> None:
        """Decode messages of a topic.

        Raises:
            LogError: They are compressed, and nothing says so.
        """
        batch = batch_of(_stamps(stamps), contents, is_ros1=self._is_ros1)
        self._take(topic, message_type, batch)

    def take_rows(self, topic: str, message_type: str, stamps: IntArray, rows: ByteArray) -> None:
        """Decode messages of a topic and of one length: rows (K, L) at stamps (K,) [ns]."""
        self._take(topic, message_type, MessageBatch([(stamps, rows)], self._is_ros1))

    def pass_over(self, count: int) -> None:
        """Count messages of a type that nothing is known of."""
        self.streams.messages_in += count
        self.streams.warnings["dropped_other_type"] += count

    def _take(self, topic: str, message_type: str, batch: MessageBatch) -> None:
        streams, choice = self.streams, self._choice
        if topic == choice.scan:
            streams.scans.extend(decode_scans(batch))
        elif topic == choice.odometry:
            streams.odometry.extend(decode_odometry(batch))
        elif topic == choice.command:
            streams.commands.extend(decode_twists(batch, message_type))
        elif topic == choice.pose:
            streams.poses.extend(decode_poses(batch))
        elif topic == choice.map:
            for grid in decode_grids(batch):
                streams.add_map(grid)
        else:
            is_static = topic in choice.static_transforms
            for transforms in decode_transforms(batch):
                streams.add_transforms(transforms, is_static=is_static)
        streams.messages_in += sum(len(stamps) for stamps, _ in batch.tables)
        streams.warnings["dropped_malformed"] += batch.malformed.count


def _stamps(stamps: Sequence[int]) -> IntArray:
    """Give stamps as an array; those beyond any clock become its last moment."""
    try:
        return np.array(stamps, dtype=np.int64)
    except OverflowError:
        return np.array([min(stamp, _LAST_STAMP) for stamp in stamps], dtype=np.int64)
