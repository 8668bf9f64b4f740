import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ses_core.arrays import FloatArray
from ses_core.extraction.recording import CommandStream, PoseStream, Recording, ScanStream
from ses_core.extraction.resampling import find_cuts, resample, velocity_source
from ses_core.geometry import Pose2D
from ses_core.robot_profile import GENERIC
from ses_core.settings import IngestSettings

SETTINGS = IngestSettings()
SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND


def recording(
    seconds: FloatArray,
    poses: FloatArray,
    *,
    twists: FloatArray | None = None,
    commands: CommandStream | None = None,
    scans: ScanStream | None = None,
    has_clock: bool = True,
) -> Recording:
    stamps = START + np.rint(np.asarray(seconds) * SECOND).astype(np.int64)
    unknown = np.full((len(stamps), 2), np.nan)
    return Recording(
        poses=PoseStream(
            stamps_ns=stamps, poses=poses, twists=unknown if twists is None else twists
        ),
        commands=commands,
        scans=scans,
        map=None,
        pose_source="odometry",
        has_clock=has_clock,
        messages_in=len(stamps),
        messages_used=len(stamps),
    )


def straight(seconds: FloatArray, speed: float = 0.5) -> FloatArray:
    return np.column_stack((speed * seconds, np.zeros_like(seconds), np.zeros_like(seconds)))


def commands_at(pairs: list[tuple[float, float]]) -> CommandStream:
    seconds = np.array([second for second, _ in pairs])
    values = np.array([[speed, 0.0] for _, speed in pairs])
    return CommandStream(
        stamps_ns=START + np.rint(seconds * SECOND).astype(np.int64), commands=values
    )


def test_steps_are_fifty_milliseconds_apart_and_poses_lie_on_the_line() -> None:
    seconds = np.arange(0.0, 10.0, 0.13)
    (trajectory,) = resample(
        recording(seconds, straight(seconds)), profile=GENERIC, settings=SETTINGS
    )
    assert np.all(np.diff(trajectory.stamps_ns) == 50_000_000)
    elapsed = (trajectory.stamps_ns - START) * 1e-9
    np.testing.assert_allclose(trajectory.poses[:, 0], 0.5 * elapsed, atol=1e-9)


def test_heading_turns_through_pi_the_short_way() -> None:
    seconds = np.array([0.0, 1.0])
    poses = np.array([[0.0, 0.0, 3.0], [0.0, 0.0, -3.0]])
    (trajectory,) = resample(recording(seconds, poses), profile=GENERIC, settings=SETTINGS)
    assert np.all(np.abs(trajectory.poses[:, 2]) >= 3.0)


def test_a_command_holds_exactly_as_long_as_the_time_out() -> None:
    seconds = np.arange(0.0, 3.0, 0.1)
    log = recording(seconds, straight(seconds), commands=commands_at([(0.5, -0.3)]))
    profile = GENERIC.model_copy(update={"command_timeout_s": 0.5})
    (trajectory,) = resample(log, profile=profile, settings=SETTINGS)
    elapsed = np.round((trajectory.stamps_ns - START) * 1e-9, 3)
    in_force = (elapsed >= 0.5) & (elapsed <= 1.0)
    np.testing.assert_array_equal(trajectory.speed[in_force], -0.3)
    np.testing.assert_array_equal(trajectory.speed[~in_force], 0.0)
    assert np.count_nonzero(trajectory.speed < 0) == 11


def test_an_absurd_command_leaves_the_speed_unknown_and_never_zero() -> None:
    seconds = np.arange(0.0, 1.0, 0.1)
    log = recording(seconds, straight(seconds), commands=commands_at([(0.0, np.nan)]))
    (trajectory,) = resample(log, profile=GENERIC, settings=SETTINGS)
    assert np.isnan(trajectory.speed[:5]).all()


@pytest.mark.parametrize(
    ("has_commands", "has_twists", "expected"),
    [
        (True, True, "commanded"),
        (False, True, "measured"),
        (False, False, "derived"),
    ],
)
def test_the_velocity_that_counts_is_commanded_then_measured_then_derived(
    has_commands: bool, has_twists: bool, expected: str
) -> None:
    seconds = np.arange(0.0, 2.0, 0.1)
    twists = np.full((len(seconds), 2), 0.2) if has_twists else None
    commands = commands_at([(k / 10, 0.1) for k in range(20)]) if has_commands else None
    log = recording(seconds, straight(seconds), twists=twists, commands=commands)
    assert velocity_source(log, SETTINGS) == expected
    (trajectory,) = resample(log, profile=GENERIC, settings=SETTINGS)
    value = {"commanded": 0.1, "measured": 0.2, "derived": 0.5}[expected]
    np.testing.assert_allclose(trajectory.speed, value)


def test_speed_from_poses_is_negative_when_the_robot_backs_along_its_heading() -> None:
    seconds = np.arange(0.0, 5.0, 0.2)
    poses = np.column_stack((np.zeros(25), -0.4 * seconds, np.full(25, np.pi / 2)))
    (trajectory,) = resample(recording(seconds, poses), profile=GENERIC, settings=SETTINGS)
    np.testing.assert_allclose(trajectory.speed, -0.4)


def test_poses_that_tremble_on_the_spot_are_not_reversing() -> None:
    seconds = np.arange(0.0, 5.0, 0.2)
    poses = np.zeros((25, 3))
    poses[::2, 0] = 0.001
    (trajectory,) = resample(recording(seconds, poses), profile=GENERIC, settings=SETTINGS)
    np.testing.assert_array_equal(trajectory.speed, 0.0)


def test_a_dropout_cuts_and_step_numbers_are_never_used_twice() -> None:
    seconds: FloatArray = np.arange(0.0, 10.0, 0.1)
    seconds[50:] += 28.0
    log = recording(seconds, straight(seconds))
    first, second = resample(log, profile=GENERIC, settings=SETTINGS)
    assert second.first_step == first.first_step + len(first) + 1
    cuts = find_cuts(log, profile=GENERIC, settings=SETTINGS)
    assert (cuts.is_gap.sum(), cuts.is_jump.sum()) == (1, 0)


def test_a_hole_of_exactly_the_gap_does_not_cut() -> None:
    seconds = np.array([0.0, 0.1, 2.1, 2.2])
    assert (
        len(resample(recording(seconds, straight(seconds)), profile=GENERIC, settings=SETTINGS))
        == 1
    )


def test_a_jump_faster_than_the_robot_cuts_and_is_counted() -> None:
    seconds = np.arange(0.0, 10.0, 0.1)
    poses = straight(seconds)
    poses[50:, 1] += 3.0
    log = recording(seconds, poses)
    assert len(resample(log, profile=GENERIC, settings=SETTINGS)) == 2
    assert find_cuts(log, profile=GENERIC, settings=SETTINGS).is_jump.sum() == 1


def test_messages_that_arrive_in_a_burst_are_no_jump() -> None:
    seconds = np.arange(0.0, 10.0, 0.1)
    poses = straight(seconds, speed=1.0)
    late = seconds.copy()
    late[50:54] = late[53] + np.array([0.0, 0.001, 0.002, 0.003])
    assert len(resample(recording(late, poses), profile=GENERIC, settings=SETTINGS)) == 1


def test_without_a_clock_every_pose_is_one_step_of_unknown_speed() -> None:
    seconds = np.arange(0.0, 0.5, 0.05)
    log = recording(seconds, straight(seconds), has_clock=False)
    (trajectory,) = resample(log, profile=GENERIC, settings=SETTINGS)
    np.testing.assert_array_equal(trajectory.poses, log.poses.poses)
    assert np.isnan(trajectory.speed).all()
    assert not trajectory.has_clock


def test_a_drive_of_a_single_pose_is_no_trajectory() -> None:
    seconds = np.array([0.0, 10.0, 20.0])
    assert resample(recording(seconds, straight(seconds)), profile=GENERIC, settings=SETTINGS) == []


def scans_at(seconds: FloatArray) -> ScanStream:
    return ScanStream(
        stamps_ns=START + np.rint(seconds * SECOND).astype(np.int64),
        ranges=np.full((len(seconds), 3), 1.23456, dtype=np.float32),
        angles=np.array([-1.0, 0.0, 1.0]),
        range_max=10.0,
        mount=Pose2D(0.0, 0.0),
    )


def test_scans_are_kept_while_moving_and_once_a_second_at_a_standstill() -> None:
    seconds = np.arange(0.0, 10.05, 0.1)
    poses = straight(np.minimum(seconds, 5.0))
    log = recording(seconds, poses, scans=scans_at(np.arange(-1.0, 12.0, 0.1)))
    (trajectory,) = resample(log, profile=GENERIC, settings=SETTINGS)
    assert trajectory.scans is not None
    assert trajectory.scan_poses is not None
    elapsed = (trajectory.scans.stamps_ns - START) * 1e-9
    assert np.count_nonzero(elapsed < 4.95) == 50
    assert np.count_nonzero(elapsed > 5.05) == 5
    assert 0.0 <= elapsed.min() <= elapsed.max() <= 10.0
    np.testing.assert_allclose(trajectory.scan_poses[:, 0], 0.5 * np.minimum(elapsed, 5.0))
    np.testing.assert_array_equal(trajectory.scans.ranges, np.float32(1.235))


@given(
    st.lists(st.floats(0.01, 4.0), min_size=2, max_size=40),
    st.lists(st.floats(-1.0, 1.0), min_size=40, max_size=40),
)
def test_trajectories_cover_every_drive_once_and_in_order(
    intervals: list[float], steps: list[float]
) -> None:
    seconds = np.cumsum(np.array(intervals, dtype=np.float64)).astype(np.float64)
    travelled = np.cumsum(np.array(steps[: len(intervals)]))
    poses = np.column_stack((travelled, np.zeros(len(seconds)), np.zeros(len(seconds))))
    log = recording(seconds, poses)
    found = resample(log, profile=GENERIC, settings=SETTINGS)
    cuts = find_cuts(log, profile=GENERIC, settings=SETTINGS)
    assert len(found) <= 1 + np.count_nonzero(cuts.is_gap | cuts.is_jump)
    numbers = [n for item in found for n in range(item.first_step, item.first_step + len(item))]
    assert len(numbers) == len(set(numbers))
    stamps = np.concatenate([item.stamps_ns for item in found]) if found else np.empty(0)
    assert np.all(np.diff(stamps) > 0)
    for item in found:
        assert set(item.stamps_ns[:1]) <= set(log.poses.stamps_ns)
        assert np.all(np.isfinite(item.poses))


def test_commands_can_be_left_out_of_account_by_setting() -> None:
    seconds = np.arange(0.0, 2.0, 0.1)
    log = recording(seconds, straight(seconds), commands=commands_at([(0.0, -1.0)]))
    settings = SETTINGS.model_copy(update={"velocity_source": "derived"})
    (trajectory,) = resample(log, profile=GENERIC, settings=settings)
    np.testing.assert_allclose(trajectory.speed, 0.5)
