"""From serialized ROS messages to columns of numbers: the few types that matter, of ROS 1 and 2.

Scans, odometry, commands and transforms are nearly all of a log, and the messages of a topic
nearly all have one form: the same frames, the same number of readings. The form is worked out
from one message; every other message of it is a row of a table of bytes, and each number a
column of that table. rosbags, which looks at each number of each message by itself, needs many
times as long for the same (tests compare both).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from ses_core.arrays import ByteArray, Float32Array, FloatArray, IntArray
from storage.message_forms import MessageForm
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
_FORMS_PER_LENGTH = 8
"""Forms of one length that are looked for among all messages; the rest is read one by one."""


@dataclass(frozen=True, slots=True)
class Scans:
    """`LaserScan`s of one frame and number of readings.

    Attributes:
        stamps_ns: (K,) log time.
        geometry: (K, 4) angle_min, angle_increment [rad], range_min, range_max [m].
        ranges: (K, B) [m] as the driver wrote them.
    """

    frame: str
    stamps_ns: IntArray
    geometry: Float32Array
    ranges: Float32Array


@dataclass(frozen=True, slots=True)
class Transforms:
    """Transforms or stamped poses: `child` as seen from `frame`; no child for a pose.

    Attributes:
        stamps_ns: (K,) log time.
        positions: (K, 3) [m].
        orientations: (K, 4) quaternions x, y, z, w.
    """

    frame: str
    child: str
    stamps_ns: IntArray
    positions: FloatArray
    orientations: FloatArray


@dataclass(frozen=True, slots=True)
class Odometry(Transforms):
    """`Odometry`: a pose in `frame`, and twists (K, 2) [m/s, rad/s] of `child`."""

    twists: FloatArray


@dataclass(frozen=True, slots=True)
class Twists:
    """`Twist`s or `TwistStamped`s: log times (K,) and velocities (K, 2) [m/s, rad/s]."""

    stamps_ns: IntArray
    twists: FloatArray


@dataclass(frozen=True, slots=True)
class Grid:
    """An `OccupancyGrid`; data (H, W) int8: -1 unknown, else percent."""

    frame: str
    stamp_ns: int
    resolution: float
    position: FloatArray
    orientation: FloatArray
    data: "np.ndarray[tuple[int, int], np.dtype[np.int8]]"


@dataclass(slots=True)
class Malformed:
    """How many messages did not have the form of their type."""

    count: int = 0


@dataclass(frozen=True, slots=True)
class MessageBatch:
    """Messages of one topic, those of one length together.

    Attributes:
        tables: (stamps (K,) [ns], rows (K, L)): log times, and serialized contents of L bytes.
    """

    tables: Sequence[tuple[IntArray, ByteArray]]
    is_ros1: bool
    malformed: Malformed = field(default_factory=Malformed)


def batch_of(
    stamps: IntArray, contents: Sequence[bytes | memoryview], *, is_ros1: bool
) -> MessageBatch:
    """Sort messages at stamps (K,) [ns] by length."""
    lengths = np.array([len(content) for content in contents], dtype=np.int64)
    tables = []
    for length in np.unique(lengths).tolist():
        alike = np.flatnonzero(lengths == length)
        content = b"".join([contents[index] for index in alike.tolist()])
        rows = np.frombuffer(content, dtype=np.uint8).reshape(len(alike), length)
        tables.append((stamps[alike], rows))
    return MessageBatch(tables, is_ros1)


_Reader = Callable[[MessageForm], Callable[[ByteArray, IntArray], Any]]
"""Reads a form and gives what makes columns of the rows that have it."""


def decode_scans(batch: MessageBatch) -> Iterator[Scans]:
    """Read `LaserScan`s."""
    return _decode(batch, _scan_form)


def decode_odometry(batch: MessageBatch) -> Iterator[Odometry]:
    """Read `Odometry`."""
    return _decode(batch, _odometry_form)


def decode_twists(batch: MessageBatch, message_type: str) -> Iterator[Twists]:
    """Read `Twist` or `TwistStamped`."""
    return _decode(batch, _stamped_twist_form if message_type == TWIST_STAMPED else _twist_form)


def decode_transforms(batch: MessageBatch) -> Iterator[list[Transforms]]:
    """Read `TFMessage`s: a list of the transforms that each message of a form holds."""
    return _decode(batch, _transforms_form)


def decode_poses(batch: MessageBatch) -> Iterator[Transforms]:
    """Read `PoseStamped` or `PoseWithCovarianceStamped`."""
    return _decode(batch, _pose_form)


def decode_grids(batch: MessageBatch) -> Iterator[Grid]:
    """Read `OccupancyGrid`s."""
    for grids in _decode(batch, _grid_form):
        yield from grids


def _decode(batch: MessageBatch, read: _Reader) -> Iterator[Any]:
    """Sort messages by form and give each form's columns."""
    for stamps, rows in batch.tables:
        yield from _decode_rows(rows, stamps, batch, read)


def _decode_rows(
    rows: ByteArray, stamps: IntArray, batch: MessageBatch, read: _Reader
) -> Iterator[Any]:
    """Give the columns of messages of one length: rows (K, L) at stamps (K,)."""
    left = np.arange(len(rows))
    forms = 0
    while len(left):
        try:
            form = MessageForm(rows[left[0]].tobytes(), is_ros1=batch.is_ros1)
            columns_of = read(form)
        except (ValueError, OverflowError):
            batch.malformed.count += 1
            left = left[1:]
            continue
        same = np.zeros(len(left), dtype=np.bool_)
        same[0] = True
        if forms < _FORMS_PER_LENGTH:
            same[:] = True
            for span in form.fixed:
                # Of all rows where all are left: a slice is no copy.
                candidates = rows[:, span] if len(left) == len(rows) else rows[left, span]
                same &= (candidates == rows[left[0], span]).all(axis=1)
        forms += 1
        if same.all() and len(left) == len(rows):
            yield columns_of(rows, stamps)
            return
        yield columns_of(rows[left[same]], stamps[left[same]])
        left = left[~same]


def _scan_form(form: MessageForm) -> Callable[[ByteArray, IntArray], Scans]:
    frame = form.header()
    numbers = form.numbers("f4", 7)
    ranges = form.numbers("f4", form.count())

    def columns(rows: ByteArray, stamps: IntArray) -> Scans:
        # angle_min, _, angle_increment, _, _, range_min, range_max
        geometry = numbers.of(rows)[:, [0, 2, 5, 6]]
        return Scans(frame, stamps, geometry, ranges.of(rows))

    return columns


def _odometry_form(form: MessageForm) -> Callable[[ByteArray, IntArray], Odometry]:
    frame, child = form.header(), form.frame()
    pose = form.numbers("f8", 7)
    form.numbers("f8", 36)
    twist = form.numbers("f8", 6)

    def columns(rows: ByteArray, stamps: IntArray) -> Odometry:
        poses, twists = pose.of(rows), twist.of(rows)[:, [0, 5]]
        return Odometry(frame, child, stamps, poses[:, :3], poses[:, 3:], twists)

    return columns


def _twist_form(form: MessageForm) -> Callable[[ByteArray, IntArray], Twists]:
    twist = form.numbers("f8", 6)
    return lambda rows, stamps: Twists(stamps, twist.of(rows)[:, [0, 5]])


def _stamped_twist_form(form: MessageForm) -> Callable[[ByteArray, IntArray], Twists]:
    form.header()
    return _twist_form(form)


def _transforms_form(form: MessageForm) -> Callable[[ByteArray, IntArray], list[Transforms]]:
    parts = [(form.header(), form.frame(), form.numbers("f8", 7)) for _ in range(form.count())]

    def columns(rows: ByteArray, stamps: IntArray) -> list[Transforms]:
        transforms = []
        for frame, child, place in parts:
            poses = place.of(rows)
            transforms.append(Transforms(frame, child, stamps, poses[:, :3], poses[:, 3:]))
        return transforms

    return columns


def _pose_form(form: MessageForm) -> Callable[[ByteArray, IntArray], Transforms]:
    frame, pose = form.header(), form.numbers("f8", 7)

    def columns(rows: ByteArray, stamps: IntArray) -> Transforms:
        poses = pose.of(rows)
        return Transforms(frame, "", stamps, poses[:, :3], poses[:, 3:])

    return columns


def _grid_form(form: MessageForm) -> Callable[[ByteArray, IntArray], list[Grid]]:
    frame = form.header()
    form.numbers("u4", 2)
    resolution = form.numbers("f4")
    width, height = form.count(), form.count()
    pose = form.numbers("f8", 7)
    cells = form.numbers("i1", form.count())
    if cells.stop - cells.start != width * height:
        raise ValueError(f"grid of {width} x {height} holds {cells.stop - cells.start} cells")

    def columns(rows: ByteArray, stamps: IntArray) -> list[Grid]:
        resolutions, poses, data = resolution.of(rows), pose.of(rows), cells.of(rows)
        return [
            Grid(
                frame,
                int(stamp),
                float(resolutions[index, 0]),
                poses[index, :3],
                poses[index, 3:],
                data[index].reshape(height, width),
            )
            for index, stamp in enumerate(stamps)
        ]

    return columns


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
