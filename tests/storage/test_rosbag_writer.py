"""Our bags as rosbags reads them, and the same bytes every time."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from ses_core.geometry import Pose2D
from storage.message_types import ros1_types, ros2_types
from tests.log_factory import LOG_KINDS, START_NS, drive, write_log


@pytest.mark.parametrize("kind", LOG_KINDS)
def test_rosbags_reads_what_was_written(kind: str, tmp_path: Path) -> None:
    content = replace(
        drive(),
        map_to_odom=Pose2D(1.0, 2.0, 0.5),
        goals=np.array([[3.0, 4.0, 0.0]]),
        goal_stamps_ns=np.array([START_NS]),
    )
    path, _ = write_log(tmp_path, kind, content)
    types = ros1_types() if path.suffix == ".bag" else ros2_types()
    counts: dict[str, int] = {}
    with AnyReader([path]) as reader:
        stamps = []
        for connection, stamp, raw in reader.messages():
            counts[connection.topic] = counts.get(connection.topic, 0) + 1
            stamps.append(stamp)
            decode = types.deserialize_ros1 if path.suffix == ".bag" else types.deserialize_cdr
            message: Any = decode(raw, connection.msgtype)
            if connection.topic == "/odom":
                index = (stamp - START_NS) // 50_000_000
                assert message.pose.pose.position.x == content.poses.poses[index, 0]
                assert message.twist.twist.linear.x == content.poses.twists[index, 0]
                assert message.header.stamp.nanosec == stamp % 10**9
            if connection.topic == "/scan" and content.scans is not None:
                np.testing.assert_array_equal(message.ranges, content.scans.ranges[0])
                assert message.range_max == 10.0
    assert stamps == sorted(stamps)
    goal = "/move_base_simple/goal" if path.suffix == ".bag" else "/goal_pose"
    assert counts == {
        "/odom": 401,
        "/tf": 802,
        "/tf_static": 1,
        "/cmd_vel": 201,
        "/scan": 100,
        "/map": 1,
        goal: 1,
    }


@pytest.mark.parametrize("kind", ["bag", "db3", "mcap"])
def test_equal_content_gives_equal_bytes(kind: str, tmp_path: Path) -> None:
    written = []
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        path, _ = write_log(tmp_path / name, kind)
        files = sorted(path.iterdir()) if path.is_dir() else [path]
        written.append([(file.name, file.read_bytes()) for file in files])
    assert written[0] == written[1]
