"""Every container gives the same recording, and every kind of dirt its declared outcome."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ses_core.arrays import FloatArray
from ses_core.errors import LogError
from ses_core.extraction.recording import Recording
from ses_core.geometry import Pose2D
from ses_core.robot_profile import GENERIC, RobotProfile
from ses_core.settings import DecoderLimits
from storage.bag_messages import BagContent
from storage.rosbag_logs import RosbagLogReader
from tests.log_factory import LOG_KINDS, MOUNT, START_NS, drive, without, write_log


def read(
    path: Path,
    scratch: Path,
    *,
    profile: RobotProfile = GENERIC,
    pose_source: str = "odometry",
) -> Recording:
    scratch.mkdir(exist_ok=True)
    reader = RosbagLogReader(limits=DecoderLimits(), workdir=scratch)
    return reader.read(_spooled(path), profile=profile, pose_source=pose_source)


def _spooled(path: Path) -> Path:
    """Give compressed parts the suffix that the spool gives them."""
    if path.is_dir():
        for part in [*path.glob("*.zstd")]:
            part.rename(part.with_suffix(".zst"))
    return path


def record(content: BagContent, tmp_path: Path, kind: str = "mcap", **options: str) -> Recording:
    path, _ = write_log(tmp_path, kind, content)
    return read(path, tmp_path / "scratch", **options)  # type: ignore[arg-type]  # by name


@pytest.mark.parametrize("kind", LOG_KINDS)
def test_every_container_gives_back_what_was_written(kind: str, tmp_path: Path) -> None:
    content = drive()
    recording = record(content, tmp_path, kind)
    np.testing.assert_array_equal(recording.poses.stamps_ns, content.poses.stamps_ns)
    np.testing.assert_allclose(recording.poses.poses, content.poses.poses, atol=1e-12)
    np.testing.assert_array_equal(recording.poses.twists, content.poses.twists)
    assert content.commands is not None
    assert recording.commands is not None
    np.testing.assert_array_equal(recording.commands.stamps_ns, content.commands.stamps_ns)
    np.testing.assert_array_equal(recording.commands.commands, content.commands.commands)
    assert content.scans is not None
    assert recording.scans is not None
    np.testing.assert_array_equal(recording.scans.stamps_ns, content.scans.stamps_ns)
    assert np.all(np.isinf(recording.scans.ranges[:, :3]))
    assert np.all(recording.scans.ranges[:, 3:] == 2.0)
    np.testing.assert_allclose(recording.scans.angles, content.scans.angles, atol=1e-5)
    mount = recording.scans.mount
    np.testing.assert_allclose((mount.x, mount.y, mount.yaw), (MOUNT.x, MOUNT.y, MOUNT.yaw))
    assert content.map is not None
    assert recording.map is not None
    np.testing.assert_array_equal(recording.map.cells, content.map.cells)
    assert recording.map.origin == content.map.origin
    assert recording.warnings == {}
    assert recording.messages_in == recording.messages_used


@pytest.mark.parametrize("kind", ["db3", "mcap"])
def test_a_bare_part_without_its_folder_reads_the_same(kind: str, tmp_path: Path) -> None:
    path, _ = write_log(tmp_path, kind)
    (part,) = path.glob(f"*.{kind}")
    bare = read(part, tmp_path / "scratch")
    whole = read(path, tmp_path / "scratch")
    np.testing.assert_array_equal(bare.poses.poses, whole.poses.poses)


def test_a_split_recording_is_read_as_one(tmp_path: Path) -> None:
    content = drive()
    half = len(content.poses.stamps_ns) // 2
    halves = []
    for start, stop in ((0, half), (half, None)):
        poses = replace(
            content.poses,
            stamps_ns=content.poses.stamps_ns[start:stop],
            poses=content.poses.poses[start:stop],
            twists=content.poses.twists[start:stop],
        )
        halves.append(replace(without(content, "commands", "scans", "map"), poses=poses))
    folder = tmp_path / "split"
    folder.mkdir()
    for number, part in enumerate(halves):
        (tmp_path / str(number)).mkdir()
        path, _ = write_log(tmp_path / str(number), "mcap", part)
        # The later part comes first by name: order is by time.
        (path / "mcap.mcap").rename(folder / f"part-{1 - number}.mcap")
    recording = read(folder, tmp_path / "scratch")
    np.testing.assert_array_equal(recording.poses.stamps_ns, content.poses.stamps_ns)


def test_message_compression_without_metadata_is_refused(tmp_path: Path) -> None:
    path, _ = write_log(tmp_path, "db3-message")
    (part,) = path.glob("*.db3")
    with pytest.raises(LogError) as error:
        read(part, tmp_path / "scratch")
    assert error.value.reason == "missing_metadata"


def test_metadata_that_names_more_parts_than_there_are_is_truncated(tmp_path: Path) -> None:
    path, _ = write_log(tmp_path, "mcap")
    metadata = path / "metadata.yaml"
    text = metadata.read_text().replace("- mcap.mcap", "- mcap.mcap\n  - more.mcap")
    metadata.write_text(text)
    with pytest.raises(LogError) as error:
        read(path, tmp_path / "scratch")
    assert error.value.reason == "truncated"


def test_metadata_nested_without_end_is_refused(tmp_path: Path) -> None:
    path, _ = write_log(tmp_path, "mcap")
    (path / "metadata.yaml").write_text("[" * 20_000)
    with pytest.raises(LogError) as error:
        read(path, tmp_path / "scratch")
    assert error.value.reason == "missing_metadata"


def test_a_log_without_scans_is_taken_with_a_warning(tmp_path: Path) -> None:
    recording = record(without(drive(), "scans"), tmp_path)
    assert recording.scans is None
    assert recording.warnings == {"no_scans": 1}


def test_poses_in_the_map_are_used_where_the_setting_asks_for_them(tmp_path: Path) -> None:
    content = replace(drive(), map_to_odom=Pose2D(10.0, 5.0, np.pi / 2))
    recording = record(content, tmp_path, pose_source="map")
    assert recording.pose_source == "map"
    np.testing.assert_allclose(recording.poses.poses[-1, 0], 10.0, atol=1e-9)
    expected = 5.0 + content.poses.poses[-1, 0]
    np.testing.assert_allclose(recording.poses.poses[-1, 1], expected)


def test_a_log_without_map_poses_falls_back_to_odometry_and_says_so(tmp_path: Path) -> None:
    recording = record(drive(), tmp_path, pose_source="map")
    assert recording.pose_source == "odometry"
    assert recording.warnings == {"no_map_pose": 1}


def with_poses(content: BagContent, poses: FloatArray) -> BagContent:
    return replace(content, poses=replace(content.poses, poses=poses))


def test_poses_that_are_no_numbers_are_dropped_and_counted(tmp_path: Path) -> None:
    content = drive()
    poses = content.poses.poses.copy()
    poses[5, 0], poses[6, 2], poses[7, 1] = np.nan, np.nan, 1e38
    recording = record(with_poses(content, poses), tmp_path)
    assert recording.warnings == {"dropped_bad_pose": 3}
    assert recording.messages_used == recording.messages_in - 3
    assert len(recording.poses.poses) == len(poses) - 3


def test_a_log_of_mostly_absurd_poses_is_refused(tmp_path: Path) -> None:
    content = drive()
    poses = content.poses.poses.copy()
    poses[: len(poses) // 2 + 1, 0] = 1e38
    with pytest.raises(LogError) as error:
        record(with_poses(content, poses), tmp_path)
    assert error.value.reason == "bad_values"


def test_absurd_velocities_become_unknown_and_are_counted(tmp_path: Path) -> None:
    content = drive()
    twists = content.poses.twists.copy()
    twists[3] = (1e38, 0.0)
    twists[4] = (0.1, -50.0)
    # Just within twice the limit of the profile is still believed.
    twists[5] = (2.0 * GENERIC.max_speed_mps, 0.0)
    content = replace(content, poses=replace(content.poses, twists=twists))
    recording = record(content, tmp_path)
    assert recording.warnings == {"absurd_velocity": 2}
    assert np.isnan(recording.poses.twists[3:5]).all()
    assert np.isfinite(recording.poses.twists[5]).all()


def test_stamps_of_another_era_are_dropped_and_counted(tmp_path: Path) -> None:
    content = drive()
    stamps = content.poses.stamps_ns.copy()
    stamps[0] = 1_000
    content = replace(content, poses=replace(content.poses, stamps_ns=stamps))
    recording = record(without(content, "scans", "commands", "map"), tmp_path, "db3")
    assert recording.warnings["dropped_bad_stamp"] == 1
    assert recording.poses.stamps_ns[0] > START_NS


def test_a_simulators_clock_is_used_with_a_warning(tmp_path: Path) -> None:
    content = without(drive(), "scans", "commands", "map")
    poses = replace(content.poses, stamps_ns=content.poses.stamps_ns - START_NS)
    recording = record(replace(content, poses=poses), tmp_path)
    assert recording.poses.stamps_ns[0] == 0
    assert recording.warnings["clock_from_zero"] == 1


def test_a_clock_that_stands_still_is_refused(tmp_path: Path) -> None:
    content = without(drive(), "scans", "commands", "map")
    poses = replace(content.poses, stamps_ns=np.full_like(content.poses.stamps_ns, START_NS))
    with pytest.raises(LogError) as error:
        record(replace(content, poses=poses), tmp_path)
    assert error.value.reason == "bad_clock"


def test_repeated_stamps_are_dropped_and_counted(tmp_path: Path) -> None:
    content = without(drive(), "scans", "commands", "map")
    stamps = content.poses.stamps_ns.copy()
    stamps[10] = stamps[9]
    recording = record(replace(content, poses=replace(content.poses, stamps_ns=stamps)), tmp_path)
    assert recording.warnings["dropped_repeated_stamp"] == 1
    assert np.all(np.diff(recording.poses.stamps_ns) > 0)


def test_a_topic_that_the_profile_names_must_be_there(tmp_path: Path) -> None:
    profile = GENERIC.model_copy(update={"scan_topic": "/front/scan"})
    path, _ = write_log(tmp_path, "mcap")
    with pytest.raises(LogError) as error:
        read(path, tmp_path / "scratch", profile=profile)
    assert error.value.reason == "missing_topic"
