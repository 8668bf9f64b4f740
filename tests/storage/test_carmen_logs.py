from pathlib import Path

import numpy as np
import pytest

from ses_core.errors import LogError
from ses_core.extraction.recording import Recording
from ses_core.extraction.resampling import resample
from ses_core.robot_profile import GENERIC
from ses_core.settings import DecoderLimits, IngestSettings
from storage.carmen_logs import STEP_NS, CarmenLogReader
from tests.log_factory import flaser_line, odom_line, write_carmen


def read(lines: list[str], tmp_path: Path, name: str = "a.log") -> Recording:
    reader = CarmenLogReader(limits=DecoderLimits())
    path = write_carmen(tmp_path / name, lines)
    return reader.read(path, profile=GENERIC, pose_source="odometry")


def driving(count: int = 40) -> list[str]:
    return [odom_line(0.05 * k, 0.0, 0.0, 10.0 + 0.2 * k) for k in range(count)]


def test_gzipped_and_plain_logs_read_the_same(tmp_path: Path) -> None:
    plain = read(driving(), tmp_path)
    packed = read(driving(), tmp_path, "a.log.gz")
    np.testing.assert_array_equal(plain.poses.poses, packed.poses.poses)
    assert plain.has_clock
    assert plain.warnings == {"clock_from_zero": 1, "no_scans": 1}
    assert np.isnan(plain.poses.twists).all()


def test_a_stamp_of_zero_or_backwards_takes_its_predecessors(tmp_path: Path) -> None:
    lines = driving()
    lines[5] = odom_line(0.25, 0.0, 0.0, 0.0)
    lines[9] = odom_line(0.45, 0.0, 0.0, 10.5)
    recording = read(lines, tmp_path)
    assert recording.warnings["dropped_repeated_stamp"] == 2
    assert np.all(np.diff(recording.poses.stamps_ns) > 0)
    # Of two poses at one stamp the later line counts.
    assert recording.poses.poses[4, 0] == 0.25
    assert recording.messages_used == recording.messages_in - 2


def test_a_scan_lies_at_the_pose_of_its_own_line(tmp_path: Path) -> None:
    lines = driving()
    lines[20:20] = [
        flaser_line([1.0] * 180, 0.97, 0.0, 0.0, 10.0 + 0.2 * 19),
        odom_line(0.97, 0.0, 0.0, 0.0),
    ]
    recording = read(lines, tmp_path)
    (trajectory,) = resample(recording, profile=GENERIC, settings=IngestSettings())
    assert trajectory.scan_poses is not None
    np.testing.assert_allclose(trajectory.scan_poses, [[0.97, 0.0, 0.0]], atol=1e-9)


@pytest.mark.parametrize(
    ("beams", "last_degrees"), [(180, 89.0), (181, 90.0), (360, 89.5), (361, 90.0)]
)
def test_beams_span_half_a_turn(beams: int, last_degrees: float, tmp_path: Path) -> None:
    lines = driving()
    lines[7:7] = [flaser_line([1.0] * (beams - 1) + [81.83], 0.3, 0.0, 0.0, 11.2)]
    recording = read(lines, tmp_path)
    assert recording.scans is not None
    degrees = np.degrees(recording.scans.angles)
    np.testing.assert_allclose(degrees[[0, -1]], [-90.0, last_degrees])
    assert np.isinf(recording.scans.ranges[0, -1])
    assert recording.scans.ranges[0, 0] == 1.0


def test_a_log_without_a_usable_clock_is_taken_pose_by_pose(tmp_path: Path) -> None:
    lines = [odom_line(0.05 * k, 0.0, 0.0, 1.13486e9) for k in range(50)]
    lines[30:30] = [flaser_line([2.0] * 181, 1.5, 0.0, 0.0, 1.13486e9)]
    recording = read(lines, tmp_path)
    assert not recording.has_clock
    assert recording.warnings == {"bad_clock": 1}
    assert len(recording.poses.poses) == 50
    assert recording.scans is not None
    # The scan belongs to the line after it.
    assert recording.scans.stamps_ns.tolist() == [30 * STEP_NS]
    (trajectory,) = resample(recording, profile=GENERIC, settings=IngestSettings())
    assert np.isnan(trajectory.speed).all()
    assert len(trajectory) == 50


def test_reversing_is_seen_in_poses_because_velocities_are_all_zero(tmp_path: Path) -> None:
    lines = [odom_line(-0.05 * k, 0.0, 0.0, 10.0 + 0.2 * k) for k in range(40)]
    (trajectory,) = resample(read(lines, tmp_path), profile=GENERIC, settings=IngestSettings())
    np.testing.assert_allclose(trajectory.speed, -0.25, atol=1e-6)


def test_broken_lines_are_dropped_and_counted(tmp_path: Path) -> None:
    broken = ["ODOM 1 2", "ODOM a b c d e f g", "FLASER 5 1.0 2.0", "FLASER -3", "NEFF 3"]
    recording = read([*driving(), *broken], tmp_path)
    assert recording.warnings["dropped_malformed"] == 4
    assert recording.messages_in == 44


def test_text_that_is_no_carmen_log_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError) as error:
        read(["hello", "world"], tmp_path)
    assert error.value.reason == "bad_magic"


def test_scans_without_poses_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError) as error:
        read([flaser_line([1.0, 2.0], 0.0, 0.0, 0.0, 1.0)], tmp_path)
    assert error.value.reason == "missing_topic"
