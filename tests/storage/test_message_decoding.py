"""Our decoding of messages against rosbags' own, on random content."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys.store import Typestore

from storage.message_decoding import (
    MessageCursor,
    decode_grid,
    decode_odometry,
    decode_pose,
    decode_scan,
    decode_transforms,
    decode_twist,
)
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

    def cursor(self, message: object, name: str) -> MessageCursor:
        serialize = self.types.serialize_ros1 if self.is_ros1 else self.types.serialize_cdr
        return MessageCursor(bytes(serialize(message, name)), is_ros1=self.is_ros1)


@pytest.fixture(params=[True, False], ids=["ros1", "ros2"], scope="module")
def writer(request: pytest.FixtureRequest) -> Writer:
    return Writer(is_ros1=bool(request.param))


@settings(max_examples=40)
@given(frame=FRAMES, numbers=st.lists(SINGLES, min_size=4, max_size=4), ranges=RANGES)
def test_scans_are_read_as_rosbags_wrote_them(
    writer: Writer, frame: str, numbers: list[float], ranges: list[float]
) -> None:
    name = "sensor_msgs/msg/LaserScan"
    low, step, near, far = numbers
    message = writer.make(
        name,
        header=writer.header(frame),
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
    scan = decode_scan(writer.cursor(message, name))
    assert (scan.frame, scan.angle_min, scan.angle_increment) == (frame, low, step)
    assert (scan.range_min, scan.range_max) == (near, far)
    assert scan.ranges.tolist() == ranges


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
    odometry = decode_odometry(writer.cursor(message, name))
    assert (odometry.frame, odometry.child) == (frame, child)
    assert [*odometry.position, *odometry.orientation] == numbers
    assert odometry.twist == twist


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
    found = decode_transforms(writer.cursor(message, name))
    assert [(item.frame, item.child) for item in found] == frames
    assert all([*item.position, *item.orientation] == numbers for item in found)


@settings(max_examples=20)
@given(frame=FRAMES, twist=st.tuples(NUMBERS, NUMBERS))
def test_commands_are_read_with_and_without_a_header(
    writer: Writer, frame: str, twist: tuple[float, float]
) -> None:
    plain, stamped = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
    message = writer.twist(*twist)
    assert decode_twist(writer.cursor(message, plain), plain) == twist
    with_header = writer.make(stamped, header=writer.header(frame), twist=message)
    assert decode_twist(writer.cursor(with_header, stamped), stamped) == twist


def test_poses_and_grids_are_read_as_rosbags_wrote_them(writer: Writer) -> None:
    numbers = [1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 0.4]
    pose_name, grid_name = "geometry_msgs/msg/PoseStamped", "nav_msgs/msg/OccupancyGrid"
    message = writer.make(pose_name, header=writer.header("map"), pose=writer.pose(numbers))
    pose = decode_pose(writer.cursor(message, pose_name))
    assert [*pose.position, *pose.orientation] == numbers
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
    grid = decode_grid(writer.cursor(message, grid_name))
    assert (grid.frame, grid.resolution) == ("map", 0.5)
    assert grid.data.tolist() == [[0, 100, -1], [50, 49, 7]]
    assert [*grid.position, *grid.orientation] == numbers


def test_a_message_that_ends_early_is_an_error(writer: Writer) -> None:
    name = "geometry_msgs/msg/Twist"
    serialize = writer.types.serialize_ros1 if writer.is_ros1 else writer.types.serialize_cdr
    whole = bytes(serialize(writer.twist(1.0, 2.0), name))
    with pytest.raises(Exception, match=r"buffer|requires"):
        decode_twist(MessageCursor(whole[:-1], is_ros1=writer.is_ros1), name)
