"""Real robots' logs, and what must come out of each."""

from pathlib import Path

import numpy as np
import pytest

from ses_core.errors import LogError
from ses_core.extraction.recording import Recording
from ses_core.extraction.resampling import find_cuts, resample
from ses_core.robot_profile import GENERIC
from ses_core.settings import DecoderLimits, IngestSettings
from storage.log_formats import CARMEN, ROSBAG1, ROSBAG2_MCAP, ROSBAG2_SQLITE, make_reader
from tests.shared_data import shared_data


def read(path: Path, tmp_path: Path) -> Recording:
    name = ROSBAG1 if path.suffix == ".bag" else CARMEN
    if path.is_dir():
        name = ROSBAG2_MCAP if next(path.glob("*.mcap"), None) else ROSBAG2_SQLITE
    reader = make_reader(name, limits=DecoderLimits(), workdir=tmp_path)
    return reader.read(path, profile=GENERIC, pose_source="odometry")


@pytest.mark.parametrize(
    ("parts", "length_m", "cut_count", "warnings"),
    [
        ("ros1/zaki0929_2019jan17_expt04.bag", 16.1, 5, {}),
        ("ros1/zaki0929_2018dec13_target_before.bag", 13.1, 0, {}),
        # Two message types on /tf, and header stamps that are 15 s ahead.
        ("ros1/zaki0929_2018feb13_col.bag", 15.7, 1, {}),
        ("ros1/yycho0108_person_follower.bag", 7.1, 0, {}),
        ("ros1/yycho0108_drive_square.bag", 5.9, 0, {"dropped_scan_geometry": 1}),
        ("ros1/ksoltan_obstacle_avoid_demo.bag", 17.5, 0, {"absurd_command": 14}),
        ("ros1/zneb97_first_drive.bag", 7.7, 0, {}),
        ("ros1/zneb97_wall_follower_left.bag", 3.2, 0, {}),
        ("ros2/macfirst_floor_take_2", 8.3, 0, {}),
        ("ros2/macfirst_floor_take_2_mcap", 8.3, 0, {}),
        ("ros2/sim_neato_wall_follower", 2.6, 0, {}),
        (
            "odd/oko_slam_corrupt_velocities.bag",
            11.5,
            0,
            {"absurd_velocity": 21, "dropped_bad_pose": 8, "mount_assumed": 1},
        ),
        ("carmen/aces-corrected.log.gz", 331.9, 0, None),
        ("carmen/csail-corrected.log.gz", 415.5, 0, {"bad_clock": 1}),
        ("carmen/belgioioso-corrected.log.gz", 246.9, 0, {"bad_clock": 1}),
    ],
)
def test_a_real_log_gives_its_known_drive(
    parts: str,
    length_m: float,
    cut_count: int,
    warnings: dict[str, int] | None,
    tmp_path: Path,
) -> None:
    recording = read(shared_data("logs", *parts.split("/")), tmp_path)
    if warnings is not None:
        assert recording.warnings == warnings
    dropped = sum(n for name, n in recording.warnings.items() if name.startswith("dropped_"))
    assert recording.messages_in == recording.messages_used + dropped
    settings = IngestSettings()
    cuts = find_cuts(recording, profile=GENERIC, settings=settings)
    assert np.count_nonzero(cuts.is_gap | cuts.is_jump) == cut_count
    trajectories = resample(recording, profile=GENERIC, settings=settings)
    length = sum(
        float(np.hypot(*np.diff(item.poses[:, :2], axis=0).T).sum()) for item in trajectories
    )
    assert length == pytest.approx(length_m, abs=0.1)


def test_a_bag_and_its_conversion_are_the_same_recording(tmp_path: Path) -> None:
    first = read(shared_data("logs", "ros2", "macfirst_floor_take_2"), tmp_path)
    second = read(shared_data("logs", "ros2", "macfirst_floor_take_2_mcap"), tmp_path)
    np.testing.assert_array_equal(first.poses.stamps_ns, second.poses.stamps_ns)
    np.testing.assert_array_equal(first.poses.poses, second.poses.poses)
    assert first.scans is not None
    assert second.scans is not None
    np.testing.assert_array_equal(first.scans.ranges, second.scans.ranges)
    # The laser of this robot is turned by a quarter: ignored, every wall comes out wrong.
    assert first.scans.mount.yaw == pytest.approx(np.pi / 2)
    assert first.scans.mount == second.scans.mount


@pytest.mark.parametrize(
    "parts", ["odd/scan_tools_scan_only.bag", "odd/philipsltd_scan_cmd_no_odom"]
)
def test_a_log_that_says_no_pose_is_refused(parts: str, tmp_path: Path) -> None:
    with pytest.raises(LogError) as error:
        read(shared_data("logs", *parts.split("/")), tmp_path)
    assert error.value.reason == "missing_topic"
