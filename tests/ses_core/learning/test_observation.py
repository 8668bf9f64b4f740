"""Tests of what a policy sees."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ses_core.learning.action import SEVEN
from ses_core.learning.observation import (
    AUTHORS_OBSERVATION,
    DEFAULT_OBSERVATION,
    OBSERVATIONS,
    PAPER_OBSERVATION,
    ObservationSpec,
    goal_distances,
    make_observer,
    observation_for,
)
from ses_core.planning.parameters import initial_parameters
from ses_core.robot_profile import (
    JACKAL,
    NEATO,
    RASPIMOUSE,
    TURTLEBOT4,
    LaserProfile,
    RobotProfile,
)
from tests.ses_core.learning.snapshots import looking_at

AHEAD = looking_at((5.0, 0.0), (1.0, 0.0))
CLEAR = np.full((1, 720), np.inf, dtype=np.float32)


def turned(laser_yaw: float) -> RobotProfile:
    return RobotProfile(
        laser=LaserProfile(
            beams=360, angle_min_rad=-math.pi, angle_max_rad=math.pi, mount_yaw_rad=laser_yaw
        )
    )


def test_presets_have_the_lengths_they_are_documented_with() -> None:
    assert AUTHORS_OBSERVATION.length(SEVEN) == 721
    assert DEFAULT_OBSERVATION.length(SEVEN) == 129
    assert PAPER_OBSERVATION.length(SEVEN) == 728


@pytest.mark.parametrize(
    ("profile", "right", "left"),
    [
        (JACKAL, -2.35619, 2.35619),
        (TURTLEBOT4, -math.pi, math.pi),
        (NEATO, -math.pi, math.pi),
        (RASPIMOUSE, -2.36, 2.09),
        (turned(math.pi), -math.pi, math.pi),
    ],
    ids=["jackal", "turtlebot4", "neato", "raspimouse", "turned"],
)
@pytest.mark.parametrize("preset", ["default", "authors", "paper"])
def test_sectors_span_what_the_laser_sees(
    preset: str, profile: RobotProfile, right: float, left: float
) -> None:
    spec = observation_for(preset, profile)
    assert (spec.sector_min_rad, spec.sector_max_rad) == (right, left)
    assert spec.name == preset
    assert spec.length(SEVEN) == OBSERVATIONS[preset].length(SEVEN)
    if profile is JACKAL:
        assert spec == OBSERVATIONS[preset]
    scan = np.full((1, profile.laser.beams), 0.5, dtype=np.float32)
    assert (make_observer(spec, profile, action=SEVEN).pool(scan) == 0.5).all()


def test_a_laser_all_round_sees_what_is_behind_the_robot() -> None:
    behind = np.full((1, 720), 9.0, dtype=np.float32)
    behind[0, 0] = 0.7
    pooled = make_observer(observation_for("default", TURTLEBOT4), TURTLEBOT4, action=SEVEN).pool(
        behind
    )[0]
    assert pooled.min() == np.float32(0.7)
    assert (make_observer(DEFAULT_OBSERVATION, TURTLEBOT4, action=SEVEN).pool(behind) == 4.0).all()


def test_authors_observation_is_that_of_ros_jackal() -> None:
    rng = np.random.default_rng(0)
    scans = rng.uniform(0.1, 5.0, (1, 720)).astype(np.float32)
    state = looking_at((3.0, 3.0), (0.6, 0.8))
    seen = make_observer(AUTHORS_OBSERVATION, JACKAL, action=SEVEN).observe(
        scans, state, initial_parameters(1, JACKAL)
    )
    expected = [*((np.clip(scans[0], 0, 2) - 1.0) / 2.0), math.atan2(0.8, 0.6) / (2 * math.pi)]
    np.testing.assert_allclose(seen[0], expected, atol=1e-6)


@pytest.mark.parametrize("broken", [np.inf, np.nan, 0.0, -1.0, 0.05])
def test_what_is_no_reading_counts_as_nothing_in_sight(broken: float) -> None:
    observer = make_observer(DEFAULT_OBSERVATION, JACKAL, action=SEVEN)
    assert (observer.pool(np.full((1, 720), broken, dtype=np.float32)) == 4.0).all()


def test_a_sector_reports_its_nearest_reading() -> None:
    scans = CLEAR.copy()
    scans[0, [6, 7, 11, 714]] = [3.0, 1.0, 2.0, 0.5]
    pooled = make_observer(DEFAULT_OBSERVATION, JACKAL, action=SEVEN).pool(scans)[0]
    assert pooled[1] == 1.0
    assert pooled[119] == 0.5
    assert np.delete(pooled, [1, 119]).min() == 4.0


@given(st.sampled_from([JACKAL, TURTLEBOT4, NEATO]), st.integers(0, 10_000))
def test_pooling_agrees_with_looking_at_every_beam(profile: RobotProfile, seed: int) -> None:
    spec = DEFAULT_OBSERVATION
    laser = profile.laser
    scans = np.random.default_rng(seed).uniform(0.0, 6.0, (1, laser.beams)).astype(np.float32)
    expected = [spec.laser_clip_m] * spec.sectors
    width = (spec.sector_max_rad - spec.sector_min_rad) / spec.sectors
    filled = set()
    for beam, reading in enumerate(scans[0]):
        share = beam / (laser.beams - 1)
        angle = laser.angle_min_rad + share * (laser.angle_max_rad - laser.angle_min_rad)
        angle = math.remainder(angle + laser.mount_yaw_rad, 2 * math.pi)
        number = min(math.floor((angle - spec.sector_min_rad) / width), spec.sectors - 1)
        if number < 0 or angle > spec.sector_max_rad + 1e-6:
            continue
        filled.add(number)
        if reading >= laser.range_min_m:
            expected[number] = min(expected[number], float(reading))
    pooled = make_observer(spec, profile, action=SEVEN).pool(scans)[0]
    for number in filled:
        assert pooled[number] == pytest.approx(expected[number])


def test_sectors_beyond_a_narrow_laser_see_nothing() -> None:
    narrow = RobotProfile(
        laser=LaserProfile(beams=181, angle_min_rad=-math.pi / 2, angle_max_rad=math.pi / 2)
    )
    pooled = make_observer(DEFAULT_OBSERVATION, narrow, action=SEVEN).pool(
        np.full((1, 181), 1.0, np.float32)
    )[0]
    assert (pooled[:19] == 4.0).all()
    assert (pooled[21:99] == 1.0).all()
    assert (pooled[101:] == 4.0).all()


def test_a_laser_coarser_than_the_sectors_leaves_no_gaps() -> None:
    coarse = RobotProfile(laser=LaserProfile(beams=60))
    pooled = make_observer(DEFAULT_OBSERVATION, coarse, action=SEVEN).pool(
        np.full((1, 60), 1.0, np.float32)
    )
    assert (pooled == 1.0).all()


def test_a_turned_laser_sees_the_same_place_alike() -> None:
    spec = ObservationSpec(name="front", sectors=3, laser_clip_m=4.0)
    straight = np.full((1, 360), 4.0, dtype=np.float32)
    straight[0, 180] = 1.0
    backwards = np.roll(straight, 180, axis=1)
    seen = make_observer(spec, turned(0.0), action=SEVEN).pool(straight)
    seen_turned = make_observer(spec, turned(math.pi), action=SEVEN).pool(backwards)
    assert seen.tolist() == seen_turned.tolist() == [[4.0, 1.0, 4.0]]


def test_the_goal_and_the_parameters_follow_the_scan() -> None:
    state = looking_at((0.0, 4.0), (0.0, 1.0))
    observer = make_observer(DEFAULT_OBSERVATION, JACKAL, action=SEVEN)
    seen = observer.observe(CLEAR, state, SEVEN.decode(np.ones((1, 7))))[0]
    assert seen[120] == pytest.approx(0.25)
    assert seen[121] == pytest.approx(-0.1)
    assert (seen[122:] == 1.0).all()
    assert (observer.observe(CLEAR, state, SEVEN.decode(-np.ones((1, 7))))[0, 122:] == -1.0).all()
    assert goal_distances(state).tolist() == [4.0]


@given(
    st.sampled_from([AUTHORS_OBSERVATION, DEFAULT_OBSERVATION, PAPER_OBSERVATION]),
    st.floats(-50, 50),
    st.floats(-50, 50),
    st.integers(0, 1000),
)
def test_observations_stay_in_their_bounds(
    spec: ObservationSpec, x: float, y: float, seed: int
) -> None:
    scans = np.random.default_rng(seed).uniform(-1, 40, (1, 720)).astype(np.float32)
    state = looking_at((x, y), (x, y))
    seen = make_observer(spec, JACKAL, action=SEVEN).observe(
        scans, state, initial_parameters(1, JACKAL)
    )[0]
    assert seen.shape == (spec.length(SEVEN),)
    assert (seen >= -spec.bounds(SEVEN)).all()
    assert (seen <= spec.bounds(SEVEN)).all()


def test_sectors_that_face_nowhere_are_refused() -> None:
    with pytest.raises(ValueError, match="expected the first to be less"):
        ObservationSpec(
            name="odd", sectors=3, laser_clip_m=1.0, sector_min_rad=1.0, sector_max_rad=1.0
        )
