"""Serialized messages out of containers, chunk by chunk; rosbags has read the index before.

rosbags looks every message up through its index, which costs more than decoding it does. A chunk
is read once here, from front to back. Nothing depends on an index that claims too much, or that
leaves something out.
"""

import sqlite3
import struct
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import closing
from pathlib import Path
from typing import BinaryIO

from rosbags import rosbag1, rosbag2
from rosbags.interfaces import Connection
from rosbags.rosbag1.reader import IndexData
from rosbags.rosbag2 import storage_mcap

from ses_core.errors import LogError
from storage.bounded_decompression import CHUNK_LIMIT

RawMessage = tuple[Connection, int, bytes | memoryview]
"""Connection, log time [ns], serialized content."""

_MCAP_MAGIC_SIZE = 8
_FOOTER, _MESSAGE, _CHUNK, _DATA_END = 0x02, 0x05, 0x06, 0x0F
_RECORD = struct.Struct("<BQ")
_MESSAGE_RECORD = struct.Struct("<BQHIQQ")
_MESSAGE_HEADER = _MESSAGE_RECORD.size - _RECORD.size
_CHUNK_HEADER = struct.Struct("<QQQII")

_ROS1_MESSAGE = b"\x02"
_LENGTH = struct.Struct("<L")
_TIME = struct.Struct("<LL")


class Ros1Reader(rosbag1.Reader):
    """Opens a ROS 1 bag without its index of messages, which nobody here needs.

    The index may say a thousand times that a message is there; chunks say how many they hold.
    """

    def open(self) -> None:
        """Open the bag; its connections count what its chunks say they hold."""
        super().open()
        counts: Counter[int] = Counter()
        for chunk in self.chunk_infos:
            counts.update(chunk.connection_counts)
        self.connections = [
            connection._replace(msgcount=counts[connection.id]) for connection in self.connections
        ]

    def read_index_data(self, pos: int, indexes: dict[int, list[IndexData]]) -> None:
        """Read nothing: whoever calls it goes to the next chunk's place by itself."""


def raw_messages(
    reader: Ros1Reader | rosbag2.Reader, path: Path, wanted: Collection[Connection]
) -> Iterator[RawMessage]:
    """Give the messages of some connections, in the order in which they were written.

    Args:
        reader: Open; decompression is bounded (`bound_rosbags`).
        path: The file it has open.
        wanted: Some of its connections.

    Raises:
        LogError: The file ends early.
    """
    if isinstance(reader, Ros1Reader):
        return _ros1_messages(reader, path, {connection.id: connection for connection in wanted})
    if path.suffix == ".mcap":
        return _mcap_messages(path, {connection.id: connection for connection in wanted})
    return _sqlite_messages(path, {connection.id: connection for connection in wanted})


def _sqlite_messages(path: Path, wanted: dict[int, Connection]) -> Iterator[RawMessage]:
    """Read a database from front to back: sorting it by time takes longer than reading it."""
    try:
        with closing(sqlite3.connect(f"file:{path}?immutable=1", uri=True)) as database:
            # What SQLite passes over by itself, transforms above all, need not become objects.
            places = ", ".join("?" * len(wanted))
            for topic, stamp, content in database.execute(
                f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({places})",
                tuple(wanted),
            ):
                # A damaged file may hold the number as text, which SQL takes for equal.
                if (connection := wanted.get(topic)) is not None:
                    yield connection, stamp, content
    except sqlite3.DatabaseError as error:
        raise LogError("truncated", f"database cannot be read: {error}") from error


def _mcap_messages(path: Path, wanted: dict[int, Connection]) -> Iterator[RawMessage]:
    """Read the data section of an MCAP file: chunks, and messages outside of any."""
    with path.open("rb") as file:
        file.seek(_MCAP_MAGIC_SIZE)
        while len(start := file.read(_RECORD.size)) == _RECORD.size:
            kind, size = _RECORD.unpack(start)
            if kind in (_DATA_END, _FOOTER):
                return
            if kind == _CHUNK:
                yield from _mcap_records(_mcap_chunk(_read(file, size)), wanted)
            elif kind == _MESSAGE:
                yield from _mcap_records(start + _read(file, size), wanted)
            else:
                file.seek(size, 1)
    raise LogError("truncated", "recording has no end")


def _mcap_chunk(record: bytes) -> bytes:
    """Inflate a chunk, and check its size and checksum."""
    try:
        *_, size, checksum, name_length = _CHUNK_HEADER.unpack_from(record)
        position = _CHUNK_HEADER.size + name_length
        name = record[_CHUNK_HEADER.size : position].decode()
        (length,) = struct.unpack_from("<Q", record, position)
    except struct.error as error:
        raise LogError("truncated", "a chunk ends in its header") from error
    content = record[position + 8 : position + 8 + length]
    return storage_mcap.decompress(content, name, size, checksum)


def _mcap_records(records: bytes, wanted: dict[int, Connection]) -> Iterator[RawMessage]:
    view, position, end = memoryview(records), 0, len(records)
    unpack, header = _MESSAGE_RECORD.unpack_from, _MESSAGE_RECORD.size
    while position < end:
        if records[position] != _MESSAGE:
            if end - position < _RECORD.size:
                raise LogError("truncated", "a chunk ends within a record")
            position += _RECORD.size + _RECORD.unpack_from(records, position)[1]
            continue
        if end - position < header:
            raise LogError("truncated", "a chunk ends within a message")
        _, size, channel, _, stamp, _ = unpack(records, position)
        following = position + _RECORD.size + size
        if size < _MESSAGE_HEADER or following > end:
            raise LogError("truncated", f"a message of {size} bytes does not fit its chunk")
        connection = wanted.get(channel)
        if connection is not None:
            yield connection, stamp, view[position + header : following]
        position = following


def _ros1_messages(
    reader: Ros1Reader, path: Path, wanted: dict[int, Connection]
) -> Iterator[RawMessage]:
    """Read the chunks of a ROS 1 bag."""
    with path.open("rb") as file:
        for chunk in reader.chunks.values():
            file.seek(chunk.datapos)
            records = chunk.decompressor(_read(file, chunk.datasize))
            try:
                yield from _ros1_records(records, wanted)
            except (struct.error, ValueError, KeyError) as error:
                raise LogError("truncated", f"a chunk is damaged: {error}") from error


def _ros1_records(records: bytes, wanted: dict[int, Connection]) -> Iterator[RawMessage]:
    view, position, end, length_of = memoryview(records), 0, len(records), _LENGTH.unpack_from
    header = _Ros1Header()
    while position < end:
        (size,) = length_of(records, position)
        start = position + 4
        (length,) = length_of(records, start + size)
        position = start + size + 4
        if position + length > end:
            raise ValueError(f"a message of {length} bytes does not fit")
        if header.fits(records, start, size):
            connection = wanted.get(length_of(records, start + header.connection)[0])
            if connection is not None:
                seconds, nanoseconds = _TIME.unpack_from(records, start + header.time)
                stamp = seconds * 10**9 + nanoseconds
                yield connection, stamp, view[position : position + length]
        position += length


class _Ros1Header:
    """The form of the headers of messages: nearly all of a bag have the same.

    Fields may stand in any order, so the first header is read field by field; another fits if
    all but its connection and its time is the same.
    """

    __slots__ = ("_ends", "_rest", "_size", "connection", "time")

    def __init__(self) -> None:
        self._size = -1
        self._rest = b""
        self._ends = (0, 0, 0, 0)
        self.connection = self.time = 0

    def fits(self, records: bytes, start: int, size: int) -> bool:
        """Tell whether this is a message's header; `connection` and `time` say where they are."""
        if size == self._size and self._others(records, start) == self._rest:
            return True
        fields = _ros1_fields(records, start, start + size)
        place, length = fields[b"op"]
        if records[place : place + length] != _ROS1_MESSAGE:
            return False
        (connection, four), (time, eight) = fields[b"conn"], fields[b"time"]
        if (four, eight) != (_LENGTH.size, _TIME.size):
            raise ValueError("connection or time of a message has the wrong size")
        self._size, self.connection, self.time = size, connection - start, time - start
        spans = sorted(((self.connection, four), (self.time, eight)))
        (first, first_size), (second, second_size) = spans
        self._ends = (first, first + first_size, second, second + second_size)
        self._rest = self._others(records, start)
        return True

    def _others(self, records: bytes, start: int) -> bytes:
        first, after_first, second, after_second = self._ends
        return (
            records[start : start + first]
            + records[start + after_first : start + second]
            + records[start + after_second : start + self._size]
        )


def _ros1_fields(records: bytes, position: int, end: int) -> dict[bytes, tuple[int, int]]:
    """Give where each field's value lies: (offset, size)."""
    fields: dict[bytes, tuple[int, int]] = {}
    while position < end:
        (size,) = _LENGTH.unpack_from(records, position)
        position += 4
        name, _, value = records[position : position + size].partition(b"=")
        fields[name] = position + size - len(value), len(value)
        position += size
    return fields


def _read(file: BinaryIO, size: int) -> bytes:
    if size > CHUNK_LIMIT:
        raise LogError("memory_limit", f"a chunk has {size} bytes, expected at most {CHUNK_LIMIT}")
    content = file.read(size)
    if len(content) != size:
        raise LogError("truncated", f"file ends {size - len(content)} bytes early")
    return content
