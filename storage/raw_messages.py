"""Serialized messages out of containers, chunk by chunk; rosbags has read the index before.

rosbags looks every message up through its index, which costs more than decoding it does. A chunk
is read once here, from front to back. Nothing depends on an index that claims too much, or that
leaves something out.
"""

import struct
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO

from rosbags import rosbag1, rosbag2
from rosbags.interfaces import Connection
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


def raw_messages(
    reader: "rosbag1.Reader | rosbag2.Reader", path: Path, wanted: Collection[Connection]
) -> Iterator[RawMessage]:
    """Give the messages of some connections, in the order in which they were written.

    Args:
        reader: Open; decompression is bounded (`bound_rosbags`).
        path: The file it has open.
        wanted: Some of its connections.

    Raises:
        LogError: The file ends early.
    """
    if isinstance(reader, rosbag1.Reader):
        return _ros1_messages(reader, path, {connection.id: connection for connection in wanted})
    if path.suffix == ".mcap":
        return _mcap_messages(path, {connection.id: connection for connection in wanted})
    return reader.messages(connections=wanted)


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
    reader: rosbag1.Reader, path: Path, wanted: dict[int, Connection]
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
    while position < end:
        (size,) = length_of(records, position)
        fields = _ros1_fields(records, position + 4, position + 4 + size)
        position += 4 + size
        (size,) = length_of(records, position)
        position += 4
        if position + size > end:
            raise ValueError(f"a message of {size} bytes does not fit")
        if fields[b"op"] == _ROS1_MESSAGE:
            connection = wanted.get(length_of(fields[b"conn"])[0])
            if connection is not None:
                seconds, nanoseconds = _TIME.unpack(fields[b"time"])
                stamp = seconds * 10**9 + nanoseconds
                yield connection, stamp, view[position : position + size]
        position += size


def _ros1_fields(records: bytes, position: int, end: int) -> dict[bytes, bytes]:
    fields: dict[bytes, bytes] = {}
    while position < end:
        (size,) = _LENGTH.unpack_from(records, position)
        position += 4
        name, _, value = records[position : position + size].partition(b"=")
        fields[name] = value
        position += size
    return fields


def _read(file: BinaryIO, size: int) -> bytes:
    if size > CHUNK_LIMIT:
        raise LogError("memory_limit", f"a chunk has {size} bytes, expected at most {CHUNK_LIMIT}")
    content = file.read(size)
    if len(content) != size:
        raise LogError("truncated", f"file ends {size - len(content)} bytes early")
    return content
