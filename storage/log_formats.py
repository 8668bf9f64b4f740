"""The formats of logs: told apart by their first bytes, read by one reader each."""

from pathlib import Path
from typing import Final

from ses_core.protocols import LogReader
from ses_core.settings import DecoderLimits

ROSBAG1: Final = "rosbag1"
ROSBAG2_SQLITE: Final = "rosbag2-sqlite3"
ROSBAG2_MCAP: Final = "rosbag2-mcap"
CARMEN: Final = "carmen"
TABLES: Final = "tables"

LOGS_FILE: Final = "logs.parquet"
TRAJECTORIES_FILE: Final = "trajectories.parquet"
SCANS_FILE: Final = "scans.parquet"
MAP_FILE: Final = "map.npz"
"""Files of a log that was taken in, and of one that comes as tables."""

SUFFIXES: Final = {ROSBAG1: ".bag", ROSBAG2_SQLITE: ".db3", ROSBAG2_MCAP: ".mcap"}
"""Suffix a file gets in the spool, whatever it was uploaded as."""

_MAGIC: Final = (
    (b"#ROSBAG V", ROSBAG1),
    (b"SQLite format 3\x00", ROSBAG2_SQLITE),
    (b"\x89MCAP0\r\n", ROSBAG2_MCAP),
)
_GZIP: Final = b"\x1f\x8b"
ZSTD_MAGIC: Final = b"\x28\xb5\x2f\xfd"
_MAGIC_SIZE: Final = 64


def detect_format(path: Path) -> str | None:
    """Tell a file's format from its first bytes; None where they say nothing known.

    CARMEN logs are text, gzipped or not: anything readable counts as one, and its reader decides.
    """
    with path.open("rb") as file:
        start = file.read(_MAGIC_SIZE)
    for magic, name in _MAGIC:
        if start.startswith(magic):
            return name
    if start.startswith(_GZIP) or (start and _is_text(start)):
        return CARMEN
    return None


def make_reader(name: str, *, limits: DecoderLimits, workdir: Path) -> LogReader:
    """Make the reader of a format.

    Raises:
        ValueError: No such format.
    """
    if name == CARMEN:
        from storage.carmen_logs import CarmenLogReader

        return CarmenLogReader(limits=limits)
    if name in SUFFIXES:
        # rosbags takes 0.15 s to import, which a CARMEN log need not wait for.
        from storage.rosbag_logs import RosbagLogReader

        return RosbagLogReader(limits=limits, workdir=workdir)
    raise ValueError(f"log format {name!r} is not one of {sorted((*SUFFIXES, CARMEN))}")


def _is_text(start: bytes) -> bool:
    return all(byte in b"\t\r\n" or 32 <= byte < 127 for byte in start)
