"""Our decoding of messages against rosbags' own, on random content."""

import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys.store import Typestore

from storage.message_decoding import (
    MessageBatch,
    batch_of,
    decode_grids,
    decode_odometry,
    decode_poses,
    decode_scans,
    decode_transforms,
    decode_twists,
)
from storage.message_layouts import LASER_SCAN
from storage.message_types import ros1_types, ros2_types

FRAMES = st.text(st.characters(codec="utf-8", exclude_characters="\x00/"), max_size=12)
NUMBERS = st.floats(allow_nan=False, width=64)
SINGLES = st.floats(allow_nan=False, width=32)
RANGES = st.lists(SINGLES, max_size=9)


class Writer:
    """Builds messages with rosbags, in one of the two serializations."""

    def __init__(self, *, is_ros1: bool) -> None:
        self.is_ros1 = is_ros1
        self.types: Typestore = ros1_types() if is_ros1 else ros2_types()

    def make(self, name: str, **fields: Any) -> Any:
        return self.types.types[name](**fields)

    def header(self, frame: str) -> object:
        stamp = self.make("builtin_interfaces/msg/Time", sec=7, nanosec=9)
        sequence = {"seq": 3} if self.is_ros1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **sequence)

    def pose(self, numbers: list[float]) -> object:
        point = self.make("geometry_msgs/msg/Point", **dict(zip("xyz", numbers[:3], strict=True)))
        turn = self.quaternion(numbers[3:])
        return self.make("geometry_msgs/msg/Pose", position=point, orientation=turn)

    def quaternion(self, numbers: list[float]) -> object:
        fields = dict(zip("xyzw", numbers, strict=True))
        return self.make("geometry_msgs/msg/Quaternion", **fields)

    def vector(self, numbers: list[float]) -> object:
        fields = dict(zip("xyz", numbers, strict=True))
        return self.make("geometry_msgs/msg/Vector3", **fields)

    def twist(self, linear: float, angular: float) -> object:
        return self.make(
            "geometry_msgs/msg/Twist",
            linear=self.vector([linear, 1.0, 2.0]),
            angular=self.vector([3.0, 4.0, angular]),
        )

    def batch(self, name: str, *messages: object) -> MessageBatch:
        serialize = self.types.serialize_ros1 if self.is_ros1 else self.types.serialize_cdr
        contents = [bytes(serialize(message, name)) for message in messages]
        return batch_of(np.arange(len(contents)), contents, is_ros1=self.is_ros1)

    def scan(self, frame: str, numbers: list[float], ranges: list[float]) -> object:
        low, step, near, far = numbers
        return self.make(
            LASER_SCAN,
            header=self.header(frame),
            angle_min=low,
            angle_max=1.0,
            angle_increment=step,
            time_increment=0.0,
            scan_time=0.0,
            range_min=near,
            range_max=far,
            ranges=np.array(ranges, dtype=np.float32),
            intensities=np.zeros(2, dtype=np.float32),
        )


@pytest.fixture(params=[True, False], ids=["ros1", "ros2"], scope="module")
def writer(request: pytest.FixtureRequest) -> Writer:
    return Writer(is_ros1=bool(request.param))


GEOMETRIES = st.lists(SINGLES, min_size=4, max_size=4)


@settings(max_examples=40)
@given(scans=st.lists(st.tuples(FRAMES, GEOMETRIES, RANGES), min_size=1, max_size=12))
def test_scans_of_any_mix_of_forms_are_read_as_rosbags_wrote_them(
    writer: Writer, scans: list[tuple[str, list[float], list[float]]]
) -> None:
    batch = writer.batch(LASER_SCAN, *(writer.scan(*scan) for scan in scans))
    found = {
        stamp: (block.frame, geometry, ranges)
        for block in decode_scans(batch)
        for stamp, geometry, ranges in zip(
            block.stamps_ns.tolist(), block.geometry.tolist(), block.ranges.tolist(), strict=True
        )
    }
    assert [found[stamp] for stamp in range(len(scans))] == scans
    assert batch.malformed.count == 0


@settings(max_examples=40)
@given(
    frame=FRAMES,
    child=FRAMES,
    numbers=st.lists(NUMBERS, min_size=7, max_size=7),
    twist=st.tuples(NUMBERS, NUMBERS),
)
def test_odometry_is_read_as_rosbags_wrote_it(
    writer: Writer, frame: str, child: str, numbers: list[float], twist: tuple[float, float]
) -> None:
    name = "nav_msgs/msg/Odometry"
    covariance = np.arange(36, dtype=np.float64)
    message = writer.make(
        name,
        header=writer.header(frame),
        child_frame_id=child,
        pose=writer.make(
            "geometry_msgs/msg/PoseWithCovariance",
            pose=writer.pose(numbers),
            covariance=covariance,
        ),
        twist=writer.make(
            "geometry_msgs/msg/TwistWithCovariance",
            twist=writer.twist(*twist),
            covariance=covariance,
        ),
    )
    (odometry,) = decode_odometry(writer.batch(name, message, message))
    assert (odometry.frame, odometry.child) == (frame, child)
    assert np.hstack((odometry.positions, odometry.orientations)).tolist() == [numbers] * 2
    assert odometry.twists.tolist() == [list(twist)] * 2


@settings(max_examples=40)
@given(
    frames=st.lists(st.tuples(FRAMES, FRAMES), max_size=3),
    numbers=st.lists(NUMBERS, min_size=7, max_size=7),
)
def test_transforms_are_read_as_rosbags_wrote_them(
    writer: Writer, frames: list[tuple[str, str]], numbers: list[float]
) -> None:
    name = "tf2_msgs/msg/TFMessage"
    transforms = [
        writer.make(
            "geometry_msgs/msg/TransformStamped",
            header=writer.header(frame),
            child_frame_id=child,
            transform=writer.make(
                "geometry_msgs/msg/Transform",
                translation=writer.vector(numbers[:3]),
                rotation=writer.quaternion(numbers[3:]),
            ),
        )
        for frame, child in frames
    ]
    message = writer.make(name, transforms=transforms)
    (found,) = decode_transforms(writer.batch(name, message))
    assert [(item.frame, item.child) for item in found] == frames
    assert all([*item.positions[0], *item.orientations[0]] == numbers for item in found)


@settings(max_examples=20)
@given(frame=FRAMES, twist=st.tuples(NUMBERS, NUMBERS))
def test_commands_are_read_with_and_without_a_header(
    writer: Writer, frame: str, twist: tuple[float, float]
) -> None:
    plain, stamped = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
    message = writer.twist(*twist)
    (found,) = decode_twists(writer.batch(plain, message), plain)
    assert found.twists.tolist() == [list(twist)]
    with_header = writer.make(stamped, header=writer.header(frame), twist=message)
    (found,) = decode_twists(writer.batch(stamped, with_header), stamped)
    assert found.twists.tolist() == [list(twist)]


def test_poses_and_grids_are_read_as_rosbags_wrote_them(writer: Writer) -> None:
    numbers = [1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 0.4]
    pose_name, grid_name = "geometry_msgs/msg/PoseStamped", "nav_msgs/msg/OccupancyGrid"
    message = writer.make(pose_name, header=writer.header("map"), pose=writer.pose(numbers))
    (pose,) = decode_poses(writer.batch(pose_name, message))
    assert [*pose.positions[0], *pose.orientations[0]] == numbers
    information = writer.make(
        "nav_msgs/msg/MapMetaData",
        map_load_time=writer.make("builtin_interfaces/msg/Time", sec=1, nanosec=2),
        resolution=0.5,
        width=3,
        height=2,
        origin=writer.pose(numbers),
    )
    cells = np.array([0, 100, -1, 50, 49, 7], dtype=np.int8)
    message = writer.make(grid_name, header=writer.header("/map"), info=information, data=cells)
    (grid,) = decode_grids(writer.batch(grid_name, message))
    assert (grid.frame, grid.resolution) == ("map", 0.5)
    assert grid.data.tolist() == [[0, 100, -1], [50, 49, 7]]
    assert [*grid.position, *grid.orientation] == numbers


def test_messages_that_end_early_are_counted_and_leave_the_others_alone(writer: Writer) -> None:
    name = "geometry_msgs/msg/Twist"
    serialize = writer.types.serialize_ros1 if writer.is_ros1 else writer.types.serialize_cdr
    whole = [bytes(serialize(writer.twist(float(k), 0.5), name)) for k in range(3)]
    cut = [whole[0][:-1], whole[1], b"", whole[2][:9]]
    batch = batch_of(np.arange(4), cut, is_ros1=writer.is_ros1)
    (found,) = decode_twists(batch, name)
    assert (found.stamps_ns.tolist(), found.twists.tolist()) == ([1], [[1.0, 0.5]])
    assert batch.malformed.count == 3
    empty = batch_of(np.arange(1), [bytes(40)], is_ros1=writer.is_ros1)
    assert list(decode_grids(empty)) == []
    assert empty.malformed.count == 1


def test_more_forms_than_are_looked_for_together_are_read_one_by_one(writer: Writer) -> None:
    frames = [f"laser-{k % 30:02d}" for k in range(60)]
    scans = [writer.scan(frame, [0.0, 0.1, 0.2, float(k)], [1.0]) for k, frame in enumerate(frames)]
    batch = writer.batch(LASER_SCAN, *scans)
    found = sorted(
        (stamp, block.frame, float(geometry[3]))
        for block in decode_scans(batch)
        for stamp, geometry in zip(block.stamps_ns.tolist(), block.geometry, strict=True)
    )
    assert found == [(k, frame, float(k)) for k, frame in enumerate(frames)]


def test_big_endian_messages_are_read_and_kept_apart_from_little_endian_ones() -> None:
    little = struct.pack("<4x6d", *range(6))
    little = b"\x00\x01" + little[2:]
    big = b"\x00\x00" + struct.pack(">2x6d", *range(10, 16))
    name = "geometry_msgs/msg/Twist"
    batch = batch_of(np.arange(2), [little, big], is_ros1=False)
    found = [block.twists.tolist() for block in decode_twists(batch, name)]
    assert found == [[[0.0, 5.0]], [[10.0, 15.0]]]
