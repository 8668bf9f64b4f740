"""Opening a recording in any ROS container, within limits: its topics and its messages."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from rosbags import rosbag2
from rosbags.interfaces import Connection

from ses_core.errors import LogError
from ses_core.settings import DecoderLimits
from storage.bounded_decompression import bound_rosbags, bounded_zstd, inflate_zstd_file
from storage.raw_messages import RawMessage, Ros1Reader, raw_messages
from storage.sqlite_guard import recover_wal, require_plain_database

METADATA_LIMIT = 2**20
"""Most bytes of a metadata.yaml: its parser needs seconds per megabyte."""

TOPICS_LIMIT = 10_000


@dataclass(frozen=True, slots=True)
class OpenRecording:
    """A recording whose index has been read.

    Attributes:
        ros_version: 1 or 2; decides how messages are serialized.
        connections: Topics, several times where several nodes published on one.
        warnings: What the container itself gave reason for.
    """

    ros_version: int
    connections: tuple[Connection, ...]
    warnings: dict[str, int]
    _parts: tuple[tuple[Ros1Reader | rosbag2.Reader, Path], ...]
    _compressed_messages: bool
    _message_limit: int

    def messages(self, topics: frozenset[str]) -> Iterator[RawMessage]:
        """Give the messages of some topics, part by part, in the order they were written.

        Raises:
            LogError: A message is larger than allowed, or a part is not whole.
        """
        limit = self._message_limit
        for reader, part in self._parts:
            wanted = [connection for connection in reader.connections if connection.topic in topics]
            if not wanted:
                continue
            for connection, stamp, content in raw_messages(reader, part, wanted):
                if self._compressed_messages:
                    content = bounded_zstd(bytes(content))
                if len(content) > limit:
                    raise LogError(
                        "memory_limit",
                        f"a message on {connection.topic!r} has {len(content)} bytes, "
                        f"expected at most {limit}",
                    )
                yield connection, stamp, content


@contextmanager
def open_recording(log: Path, *, limits: DecoderLimits, workdir: Path) -> Iterator[OpenRecording]:
    """Open a spooled recording: one `.bag`, `.db3` or `.mcap` file, or the parts of a folder.

    Args:
        log: Named by us; its suffix says what its first bytes said.
        limits: Caps on sizes.
        workdir: Empty folder for what has to be inflated.

    Raises:
        LogError: The recording cannot be opened.
    """
    bound_rosbags()
    message_limit = limits.message_mib * 2**20
    metadata = _read_metadata(log) if log.is_dir() else {}
    parts = _parts(log, metadata, limit=limits.output_mib * 2**20, workdir=workdir)
    log_is_lost = False
    for part in parts:
        if part.suffix == ".db3":
            log_is_lost |= recover_wal(part)
            require_plain_database(part, message_limit=message_limit)
    is_ros1 = log.suffix == ".bag"
    with ExitStack() as stack:
        readers = [Ros1Reader(part) if is_ros1 else rosbag2.Reader(part) for part in parts]
        for reader in readers:
            stack.enter_context(reader)
        connections = tuple(connection for reader in readers for connection in reader.connections)
        if len(connections) > TOPICS_LIMIT:
            raise LogError(
                "unsupported", f"{len(connections)} topics, expected at most {TOPICS_LIMIT}"
            )
        count = sum(connection.msgcount for connection in connections)
        if count == 0:
            raise LogError("empty", "recording holds no message")
        declared = metadata.get("message_count")
        if isinstance(declared, int):
            # A recorder that closed its files also counted: then nothing was left in a log.
            log_is_lost = declared > count
        yield OpenRecording(
            ros_version=1 if is_ros1 else 2,
            connections=connections,
            warnings={"maybe_truncated": 1} if log_is_lost else {},
            _parts=tuple(zip(readers, parts, strict=True)),
            _compressed_messages=_mode(metadata) == "message",
            _message_limit=message_limit,
        )


def _parts(log: Path, metadata: dict[str, Any], *, limit: int, workdir: Path) -> list[Path]:
    """Give the storage files of a log, inflated where they were compressed as files."""
    if not log.is_dir():
        return [log]
    parts = sorted(path for path in log.iterdir() if path.suffix in (".db3", ".mcap", ".zst"))
    if len(parts) < (named := len(metadata.get("relative_file_paths", ()))):
        raise LogError(
            "truncated", f"metadata.yaml names {named} files, the folder holds {len(parts)}"
        )
    if not parts:
        raise LogError("empty", "folder holds no recording")
    inflated: list[Path] = []
    for part in parts:
        if part.suffix == ".zst":
            target = workdir / part.stem
            limit -= inflate_zstd_file(part, target, limit=limit)
            inflated.append(target)
        else:
            inflated.append(part)
    return inflated


def _mode(metadata: dict[str, Any]) -> str:
    return str(metadata.get("compression_mode") or "").lower()


def _read_metadata(folder: Path) -> dict[str, Any]:
    """Read what `metadata.yaml` says of a folder; {} where there is none."""
    path = folder / "metadata.yaml"
    if not path.exists():
        return {}
    if path.stat().st_size > METADATA_LIMIT:
        raise LogError("missing_metadata", f"metadata.yaml is larger than {METADATA_LIMIT} bytes")
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), Loader=yaml.CSafeLoader)
        information = content["rosbag2_bagfile_information"]
        formats = {
            str(topic["topic_metadata"]["serialization_format"])
            for topic in information.get("topics_with_message_count") or ()
        }
        paths: Sequence[object] = information["relative_file_paths"]
        if not (isinstance(information, dict) and isinstance(paths, list)):
            raise TypeError("relative_file_paths is no list")
    except (yaml.YAMLError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise LogError("missing_metadata", f"metadata.yaml cannot be used: {error}") from error
    except RecursionError as error:
        raise LogError("missing_metadata", "metadata.yaml is nested too deeply") from error
    if formats - {"cdr"}:
        raise LogError("unsupported", f"serialization {sorted(formats)} is not cdr")
    compression = information.get("compression_format") or ""
    if _mode(information) in ("file", "message") and compression != "zstd":
        raise LogError("unsupported", f"compression {str(compression)[:40]!r} is not zstd")
    return information
