"""`MessageForm`: where in a serialized ROS message its numbers lie."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ses_core.arrays import ByteArray
from ses_core.errors import LogError

_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_ENCAPSULATION = 4


class MessageForm:
    """Where in a message its numbers lie, found by reading one message from front to back.

    `fixed` are the bytes that decide this: whoever has the same ones and the same length has its
    numbers at the same places.

    Raises, from any method, `ValueError` where the message is too short.
    """

    __slots__ = ("_content", "_is_ros1", "_offset", "_order", "_start", "fixed")

    def __init__(self, content: bytes, *, is_ros1: bool) -> None:
        self._content = content
        self._is_ros1 = is_ros1
        self._start = self._offset = 0 if is_ros1 else _ENCAPSULATION
        self._order = "<"
        self.fixed: list[slice] = []
        if not is_ros1:
            if content[:4] == _ZSTD_MAGIC:
                raise LogError(
                    "missing_metadata", "messages are compressed and no metadata.yaml says so"
                )
            if len(content) < _ENCAPSULATION or content[0] != 0 or content[1] > 1:
                raise ValueError("message has no CDR encapsulation")
            self._order = "<" if content[1] == 1 else ">"
            self.fixed.append(slice(0, 2))

    def numbers(self, code: str, count: int = 1) -> "Place":
        """Pass over numbers of one type, and say where they are."""
        dtype = np.dtype(self._order + code)
        if not self._is_ros1:
            self._offset += -(self._offset - self._start) % dtype.itemsize
        start = self._offset
        self._offset += count * dtype.itemsize
        if self._offset > len(self._content):
            raise ValueError(f"message ends {self._offset - len(self._content)} bytes early")
        return Place(start, self._offset, dtype)

    def count(self) -> int:
        """Read a length, which is the same in all messages of the form."""
        place = self.numbers("u4")
        self.fixed.append(slice(place.start, place.stop))
        return int(np.frombuffer(self._content[place.start : place.stop], place.dtype)[0])

    def text(self) -> str:
        """Read a string, which is the same in all messages of the form."""
        place = self.numbers("u1", self.count())
        self.fixed.append(slice(place.start, place.stop))
        raw = self._content[place.start : place.stop]
        return raw.rstrip(b"\x00").decode("utf-8", errors="replace")

    def frame(self) -> str:
        """Read the name of a frame without its leading slash."""
        return self.text().lstrip("/")

    def header(self) -> str:
        """Read a `std_msgs/Header` and give its frame."""
        self.numbers("u4", 3 if self._is_ros1 else 2)
        return self.frame()


@dataclass(frozen=True, slots=True)
class Place:
    """Where numbers of one type lie in each row of a table of bytes."""

    start: int
    stop: int
    dtype: "np.dtype[Any]"

    def of(self, rows: ByteArray) -> NDArray[Any]:
        """Give the numbers (K, N) of rows (K, L), as an array of its own."""
        raw = np.ascontiguousarray(rows[:, self.start : self.stop])
        numbers = raw.view(self.dtype)
        return numbers.astype(self.dtype.newbyteorder("="), copy=numbers.base is not raw)
