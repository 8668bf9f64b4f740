"""Small real logs of every format, written by our own writer: a drive out and back, in a room."""

import gzip
from pathlib import Path

import numpy as np

from ses_core.extraction.recording import (
    CommandStream,
    PoseStream,
    RecordedMap,
    ScanStream,
)
from ses_core.geometry import Pose2D
from storage.bag_messages import BagContent
from storage.log_formats import ROSBAG1, ROSBAG2_MCAP, ROSBAG2_SQLITE
from storage.rosbag_writer import BagCompression, BagFormat, write_rosbag

START_NS = 1_700_000_000_000_000_000
PERIOD_NS = 50_000_000
MOUNT = Pose2D(0.1, -0.02, 0.4)

LOG_KINDS: dict[str, tuple[BagFormat, BagCompression]] = {
    "bag": ("bag", "none"),
    "bag-bz2": ("bag", "bz2"),
    "bag-lz4": ("bag", "lz4"),
    "db3": ("db3", "none"),
    "db3-file": ("db3", "file"),
    "db3-message": ("db3", "message"),
    "mcap": ("mcap", "none"),
    "mcap-storage": ("mcap", "storage"),
    "mcap-file": ("mcap", "file"),
    "mcap-message": ("mcap", "message"),
}
"""Every container and compression that robots write, by a short name."""

FORMAT_OF: dict[BagFormat, str] = {
    "bag": ROSBAG1,
    "db3": ROSBAG2_SQLITE,
    "mcap": ROSBAG2_MCAP,
}


def drive(seconds: float = 20.0, *, speed: float = 0.5, beams: int = 60) -> BagContent:
    """Give a drive: forwards for three quarters of the time, then backwards, along a corridor."""
    count = round(seconds / (PERIOD_NS * 1e-9)) + 1
    stamps = START_NS + PERIOD_NS * np.arange(count, dtype=np.int64)
    velocity = np.where(np.arange(count) < 0.75 * count, speed, -speed)
    travelled = np.concatenate(([0.0], np.cumsum(velocity[:-1]) * PERIOD_NS * 1e-9))
    poses = np.column_stack((travelled, np.zeros(count), np.zeros(count)))
    twists = np.column_stack((velocity, np.zeros(count)))
    angles = np.linspace(-1.5, 1.5, beams)
    scan_stamps = stamps[::4] + 1_000_000
    scan_stamps = scan_stamps[scan_stamps <= stamps[-1]]
    ranges = np.full((len(scan_stamps), beams), 2.0, dtype=np.float32)
    ranges[:, :3] = (0.0, np.nan, np.inf)
    return BagContent(
        poses=PoseStream(stamps_ns=stamps, poses=poses, twists=twists),
        commands=CommandStream(stamps_ns=stamps[::2], commands=twists[::2]),
        scans=ScanStream(
            stamps_ns=scan_stamps, ranges=ranges, angles=angles, range_max=10.0, mount=MOUNT
        ),
        map=RecordedMap(
            cells=np.array([[0, 1], [2, 0], [1, 1]], dtype=np.uint8),
            resolution=0.05,
            origin=Pose2D(-1.0, 2.0, 0.0),
        ),
    )


def write_log(folder: Path, kind: str, content: BagContent | None = None) -> tuple[Path, str]:
    """Write a log of one of `LOG_KINDS`; gives its path (file or folder) and its format."""
    container, compression = LOG_KINDS[kind]
    path = folder / (f"{kind}.bag" if container == "bag" else kind)
    write_rosbag(path, content or drive(), format=container, compression=compression)
    return path, FORMAT_OF[container]


def without(content: BagContent, *names: str) -> BagContent:
    """Leave streams out of a log."""
    return BagContent(
        poses=content.poses,
        commands=None if "commands" in names else content.commands,
        scans=None if "scans" in names else content.scans,
        map=None if "map" in names else content.map,
    )


def write_carmen(path: Path, lines: list[str]) -> Path:
    """Write a CARMEN log; gzipped if the name ends in .gz."""
    text = "\n".join(["# message formats defined: PARAM ODOM FLASER", *lines, ""]).encode()
    path.write_bytes(gzip.compress(text) if path.suffix == ".gz" else text)
    return path


def odom_line(x: float, y: float, yaw: float, stamp: float) -> str:
    """Give an ODOM line of a corrected log: its velocities are always 0."""
    return f"ODOM {x:g} {y:g} {yaw:g} 0 0 0 {stamp:.3f} host {stamp:.3f}"


def flaser_line(ranges: list[float], x: float, y: float, yaw: float, stamp: float) -> str:
    """Give a FLASER line."""
    readings = " ".join(f"{reading:g}" for reading in ranges)
    pose = f"{x:g} {y:g} {yaw:g}"
    return f"FLASER {len(ranges)} {readings} {pose} {pose} {stamp:.3f} host {stamp:.3f}"
