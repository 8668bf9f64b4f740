"""Byte layouts of the ROS messages a fleet records, so that whole streams are written at once.

Every message of a stream has the same length when its frame names do, so a stream is one
structured array and a message is one row of it. The layout follows the serialization: CDR (ROS 2)
aligns each field to its size and ends strings with a zero byte, ROS 1 packs without either and
carries a sequence number in its header.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Serialization = Literal["cdr", "ros1"]

LASER_SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TWIST = "geometry_msgs/msg/Twist"
TWIST_STAMPED = "geometry_msgs/msg/TwistStamped"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
POSE_STAMPED = "geometry_msgs/msg/PoseStamped"
POSE_WITH_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"
OCCUPANCY_GRID = "nav_msgs/msg/OccupancyGrid"

_CDR_LITTLE_ENDIAN = b"\x00\x01\x00\x00"


@dataclass(slots=True)
class LayoutBuilder:
    """Collects the fields of one message in order and gives their structured dtype."""

    serialization: Serialization
    _names: list[str] = field(default_factory=list)
    _formats: list[str] = field(default_factory=list)
    _offsets: list[int] = field(default_factory=list)
    _constants: dict[str, object] = field(default_factory=dict)
    _size: int = 0

    def __post_init__(self) -> None:
        if self.serialization == "cdr":
            self._append("encapsulation", "V4", _CDR_LITTLE_ENDIAN)

    def add(self, name: str, code: str, count: int = 1) -> None:
        """Add a number or a fixed run of numbers: little-endian numpy code such as `f8`."""
        size = np.dtype(code).itemsize
        if self.serialization == "cdr":
            # Alignment counts from behind the four bytes of encapsulation.
            self._size += -(self._size - len(_CDR_LITTLE_ENDIAN)) % size
        self._append(name, f"<{code}" if count == 1 else f"({count},)<{code}", None, size * count)

    def add_constant(self, name: str, code: str, value: object) -> None:
        """Add a number that is the same in every message."""
        self.add(name, code)
        self._constants[name] = value

    def add_string(self, name: str, text: str) -> None:
        """Add a string that is the same in every message."""
        content = text.encode() + (b"\x00" if self.serialization == "cdr" else b"")
        self.add_constant(f"{name}_length", "u4", len(content))
        if content:
            self._append(name, f"V{len(content)}", content)

    def add_header(self, frame: str) -> None:
        """Add a `std_msgs/Header` whose stamp is filled in per message."""
        if self.serialization == "ros1":
            self.add("seq", "u4")
        self.add("sec", "u4")
        self.add("nanosec", "u4")
        self.add_string("frame", frame)

    def rows(self, count: int) -> NDArray[np.void]:
        """Give zeroed messages (count,) with the constants filled in."""
        dtype = np.dtype(
            {
                "names": self._names,
                "formats": self._formats,
                "offsets": self._offsets,
                "itemsize": self._size,
            }
        )
        rows = np.zeros(count, dtype=dtype)
        for name, value in self._constants.items():
            rows[name] = np.void(value) if isinstance(value, bytes) else value
        if "seq" in self._names:
            rows["seq"] = np.arange(count)
        return rows

    def _append(
        self, name: str, code: str, constant: object = None, size: int | None = None
    ) -> None:
        self._names.append(name)
        self._formats.append(code)
        self._offsets.append(self._size)
        self._size += np.dtype(code).itemsize if size is None else size
        if constant is not None:
            self._constants[name] = constant
