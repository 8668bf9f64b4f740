"""From serialized ROS messages to plain numbers: the few types that matter, of ROS 1 and 2.

Scans, odometry, commands and transforms are nearly all of a log. Their numbers lie at places
that follow from the frame names' lengths, so they are taken out directly; rosbags needs five
times as long for the same (tests compare both).
"""

import struct
from dataclasses import dataclass
from typing import Final

import numpy as np

from ses_core.arrays import Float32Array
from ses_core.errors import LogError
from storage.message_layouts import (
    LASER_SCAN,
    OCCUPANCY_GRID,
    ODOMETRY,
    POSE_STAMPED,
    POSE_WITH_COVARIANCE,
    TRANSFORMS,
    TWIST,
    TWIST_STAMPED,
)

OLD_TRANSFORMS: Final = "tf/msg/tfMessage"
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"

Position = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Scan:
    """A `LaserScan`; ranges (B,) [m] as the driver wrote them."""

    frame: str
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: Float32Array


@dataclass(frozen=True, slots=True)
class Odometry:
    """An `Odometry`: pose in `frame`, twist (v, w) [m/s, rad/s] of `child`."""

    frame: str
    child: str
    position: Position
    orientation: Quaternion
    twist: tuple[float, float]


@dataclass(frozen=True, slots=True)
class FramedTransform:
    """A transform or a stamped pose: `child` as seen from `frame`; no child for a pose."""

    frame: str
    child: str
    position: Position
    orientation: Quaternion


@dataclass(frozen=True, slots=True)
class Grid:
    """An `OccupancyGrid`; data (H, W) int8: -1 unknown, else percent."""

    frame: str
    resolution: float
    position: Position
    orientation: Quaternion
    data: "np.ndarray[tuple[int, int], np.dtype[np.int8]]"


class MessageCursor:
    """Reads one serialized message from front to back.

    Raises, from any method, `struct.error` or `ValueError` where the message is too short.
    """

    __slots__ = ("_content", "_is_ros1", "_offset", "_order", "_start")

    def __init__(self, content: bytes, *, is_ros1: bool) -> None:
        self._content = content
        self._is_ros1 = is_ros1
        self._start = self._offset = 0 if is_ros1 else 4
        self._order = "<"
        if not is_ros1:
            if content[:4] == _ZSTD_MAGIC:
                raise LogError(
                    "missing_metadata", "messages are compressed and no metadata.yaml says so"
                )
            if len(content) < 4 or content[0] != 0 or content[1] > 1:
                raise ValueError("message has no CDR encapsulation")
            self._order = "<" if content[1] == 1 else ">"

    def numbers(self, codes: str) -> tuple[float, ...]:
        """Read numbers of one size, given as a `struct` format such as `7d`."""
        layout = struct.Struct(self._order + codes)
        self._align(struct.calcsize("=" + codes[-1]))
        values = layout.unpack_from(self._content, self._offset)
        self._offset += layout.size
        return values

    def count(self) -> int:
        """Read a length."""
        return int(self.numbers("I")[0])

    def text(self) -> str:
        """Read a string."""
        length = self.count()
        raw = self._take(length)
        return raw.rstrip(b"\x00").decode("utf-8", errors="replace")

    def array(self, code: str, count: int) -> "np.ndarray[tuple[int], np.dtype[np.generic]]":
        """Read a run of numbers as an array of its own."""
        dtype = np.dtype(self._order + code)
        self._align(dtype.itemsize)
        raw = self._take(count * dtype.itemsize)
        return np.frombuffer(raw, dtype=dtype).astype(dtype.newbyteorder("="))

    def header(self) -> str:
        """Read a `std_msgs/Header` and give its frame without a leading slash."""
        self.numbers("3I" if self._is_ros1 else "2I")
        return self.text().lstrip("/")

    def pose(self) -> tuple[Position, Quaternion]:
        """Read a `Pose` or a `Transform`."""
        x, y, z, qx, qy, qz, qw = self.numbers("7d")
        return (x, y, z), (qx, qy, qz, qw)

    def skip(self, code: str, count: int) -> None:
        """Pass over numbers."""
        size = struct.calcsize("=" + code)
        self._align(size)
        self._take(size * count)

    def _align(self, size: int) -> None:
        if not self._is_ros1:
            self._offset += -(self._offset - self._start) % size

    def _take(self, size: int) -> bytes:
        raw = self._content[self._offset : self._offset + size]
        if len(raw) != size:
            raise ValueError(f"message ends {size - len(raw)} bytes early")
        self._offset += size
        return raw


def decode_scan(cursor: MessageCursor) -> Scan:
    """Read a `LaserScan`."""
    frame = cursor.header()
    angle_min, _, increment, _, _, range_min, range_max = cursor.numbers("7f")
    ranges = cursor.array("f4", cursor.count()).astype(np.float32, copy=False)
    return Scan(frame, angle_min, increment, range_min, range_max, ranges)


def decode_odometry(cursor: MessageCursor) -> Odometry:
    """Read an `Odometry`."""
    frame = cursor.header()
    child = cursor.text().lstrip("/")
    position, orientation = cursor.pose()
    cursor.skip("d", 36)
    twist = cursor.numbers("6d")
    return Odometry(frame, child, position, orientation, (twist[0], twist[5]))


def decode_twist(cursor: MessageCursor, message_type: str) -> tuple[float, float]:
    """Read the linear and angular velocity [m/s, rad/s] of a `Twist` or `TwistStamped`."""
    if message_type == TWIST_STAMPED:
        cursor.header()
    twist = cursor.numbers("6d")
    return twist[0], twist[5]


def decode_transforms(cursor: MessageCursor) -> list[FramedTransform]:
    """Read a `TFMessage`."""
    transforms = []
    for _ in range(cursor.count()):
        frame = cursor.header()
        child = cursor.text().lstrip("/")
        transforms.append(FramedTransform(frame, child, *cursor.pose()))
    return transforms


def decode_pose(cursor: MessageCursor) -> FramedTransform:
    """Read a `PoseStamped` or `PoseWithCovarianceStamped`."""
    frame = cursor.header()
    return FramedTransform(frame, "", *cursor.pose())


def decode_grid(cursor: MessageCursor) -> Grid:
    """Read an `OccupancyGrid`."""
    frame = cursor.header()
    cursor.skip("I", 2)
    resolution = cursor.numbers("f")[0]
    width, height = cursor.count(), cursor.count()
    position, orientation = cursor.pose()
    data = cursor.array("i1", cursor.count()).astype(np.int8, copy=False)
    return Grid(frame, resolution, position, orientation, data.reshape(height, width))


KNOWN_TYPES: Final = frozenset(
    (
        LASER_SCAN,
        OCCUPANCY_GRID,
        ODOMETRY,
        OLD_TRANSFORMS,
        POSE_STAMPED,
        POSE_WITH_COVARIANCE,
        TRANSFORMS,
        TWIST,
        TWIST_STAMPED,
    )
)
"""Types that can be decoded here; nothing else in a log is ever touched."""
