"""Logs made to harm whoever reads them, each with the reason it must be refused for."""

import bz2
import sqlite3
import struct
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from storage.bounded_decompression import CHUNK_LIMIT
from storage.log_formats import CARMEN, ROSBAG1, ROSBAG2_MCAP, ROSBAG2_SQLITE
from storage.message_types import ros1_types
from tests.log_factory import write_log


def bz2_bomb(folder: Path) -> tuple[Path, str]:
    """A bag of a few kilobytes whose only chunk inflates beyond what a chunk may hold."""
    # A gibibyte takes half a minute to pack; it inflates no further than this one does.
    size = CHUNK_LIMIT + 2**22
    packer = bz2.BZ2Compressor()
    block = bytes(2**20)
    packed = b"".join(packer.compress(block) for _ in range(size // 2**20)) + packer.flush()
    definition, digest = ros1_types().generate_msgdef("nav_msgs/msg/Odometry")
    connection = _record(
        {"op": b"\x07", "conn": _u32(0), "topic": b"/odom"},
        _fields(
            {
                "topic": b"/odom",
                "type": b"nav_msgs/Odometry",
                "md5sum": digest.encode(),
                "message_definition": definition.encode(),
            }
        ),
    )
    time = _u32(1_700_000_000) + _u32(0)
    chunk = _record({"op": b"\x05", "compression": b"bz2", "size": _u32(size)}, packed)
    index = _record(
        {"op": b"\x04", "ver": _u32(1), "conn": _u32(0), "count": _u32(1)}, time + _u32(0)
    )
    magic = b"#ROSBAG V2.0\n"
    chunk_position = len(magic) + 4096
    information = _record(
        {
            "op": b"\x06",
            "ver": _u32(1),
            "chunk_pos": struct.pack("<Q", chunk_position),
            "start_time": time,
            "end_time": time,
            "count": _u32(1),
        },
        _u32(0) + _u32(1),
    )
    index_position = chunk_position + len(chunk) + len(index)
    header = _fields(
        {
            "op": b"\x03",
            "index_pos": struct.pack("<Q", index_position),
            "conn_count": _u32(1),
            "chunk_count": _u32(1),
        }
    )
    padding = b" " * (4096 - 8 - len(header))
    start = _u32(len(header)) + header + _u32(len(padding)) + padding
    path = folder / "bomb.bag"
    path.write_bytes(magic + start + chunk + index + connection + information)
    return path, ROSBAG1


def truncated(kind: str) -> Callable[[Path], tuple[Path, str]]:
    """A log that lost its last third."""

    def make(folder: Path) -> tuple[Path, str]:
        path, name = write_log(folder, kind)
        if path.is_dir():
            path = next(part for part in path.iterdir() if part.name != "metadata.yaml")
        content = path.read_bytes()
        path.write_bytes(content[: len(content) * 2 // 3])
        return path, name

    return make


def truncated_carmen(folder: Path) -> tuple[Path, str]:
    """A gzipped CARMEN log that lost its end."""
    from tests.log_factory import odom_line, write_carmen

    lines = [odom_line(k * 0.01, 0.0, 0.0, k * 0.1) for k in range(500)]
    path = write_carmen(folder / "cut.log.gz", lines)
    path.write_bytes(path.read_bytes()[:-40])
    return path, CARMEN


def foreign_definition(folder: Path) -> tuple[Path, str]:
    """A bag whose odometry is defined otherwise: its definition must never be compiled."""
    from rosbags import rosbag1

    path = folder / "foreign.bag"
    with rosbag1.Writer(path) as writer:
        connection = writer.add_connection(
            "/odom", "nav_msgs/msg/Odometry", msgdef="Odd[] odds\n", md5sum="*"
        )
        writer.write(connection, 1_700_000_000_000_000_000, b"\x00" * 100)
    return path, ROSBAG1


def database(*statements: str) -> Callable[[Path], tuple[Path, str]]:
    """A bag in SQLite on which statements were run afterwards."""

    def make(folder: Path) -> tuple[Path, str]:
        path, name = write_log(folder, "db3")
        part = next(path.glob("*.db3"))
        with closing(sqlite3.connect(part)) as connection:
            for statement in statements:
                connection.execute(statement)
            connection.commit()
        return part, name

    return make


def garbage(suffix: str, name: str) -> Callable[[Path], tuple[Path, str]]:
    """Bytes that begin like nothing."""

    def make(folder: Path) -> tuple[Path, str]:
        path = folder / f"garbage{suffix}"
        path.write_bytes(bytes(range(256)) * 40)
        return path, name

    return make


HOSTILE: dict[str, tuple[Callable[[Path], tuple[Path, str]], frozenset[str]]] = {
    "truncated bag": (truncated("bag"), frozenset({"truncated"})),
    "truncated db3": (truncated("db3"), frozenset({"truncated"})),
    "truncated mcap": (truncated("mcap"), frozenset({"truncated"})),
    "truncated carmen": (truncated_carmen, frozenset({"truncated"})),
    "garbage as bag": (garbage(".bag", ROSBAG1), frozenset({"bad_magic", "truncated"})),
    "garbage as db3": (garbage(".db3", ROSBAG2_SQLITE), frozenset({"truncated"})),
    "garbage as mcap": (garbage(".mcap", ROSBAG2_MCAP), frozenset({"bad_magic"})),
    "garbage as carmen": (garbage(".log", CARMEN), frozenset({"bad_magic"})),
    "foreign definition": (foreign_definition, frozenset({"unknown_definition"})),
    "view": (
        database(
            "ALTER TABLE messages RENAME TO hidden",
            "CREATE VIEW messages AS SELECT * FROM hidden",
        ),
        frozenset({"unsupported"}),
    ),
    "generated column": (
        database("ALTER TABLE topics ADD COLUMN extra AS (zeroblob(2000000000)) VIRTUAL"),
        frozenset({"unsupported"}),
    ),
    "trigger": (
        database("CREATE TRIGGER bite AFTER INSERT ON messages BEGIN DELETE FROM messages; END"),
        frozenset({"unsupported"}),
    ),
    "text in stamps": (
        database("UPDATE messages SET timestamp = 'soon' WHERE id = 3"),
        frozenset({"schema_conflict"}),
    ),
    "huge value": (
        database("UPDATE messages SET data = zeroblob(200000000) WHERE id = 3"),
        frozenset({"memory_limit"}),
    ),
    "no messages": (database("DELETE FROM messages"), frozenset({"empty"})),
}


def _u32(number: int) -> bytes:
    return struct.pack("<I", number)


def _fields(fields: dict[str, bytes]) -> bytes:
    parts = [name.encode() + b"=" + value for name, value in fields.items()]
    return b"".join(_u32(len(part)) + part for part in parts)


def _record(header: dict[str, bytes], data: bytes) -> bytes:
    packed = _fields(header)
    return _u32(len(packed)) + packed + _u32(len(data)) + data
