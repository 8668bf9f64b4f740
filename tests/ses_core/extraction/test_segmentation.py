"""Algorithm 2: where scenarios end, and what they count."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ses_core.extraction.scenario import Scenario
from ses_core.extraction.segmentation import closing_steps, segment
from ses_core.settings import ExtractionSettings
from tests.ses_core.extraction.drives import drive_along, straight, wandering

SETTINGS = ExtractionSettings()


def distance(scenario: Scenario) -> float:
    return math.dist((scenario.start.x, scenario.start.y), scenario.goal)


def test_step_exactly_at_five_metres_does_not_end_a_scenario() -> None:
    at_five = drive_along(np.array([[0.0, 0.0], [3.0, 4.0]]))
    assert [one.kind for one in segment(at_five, settings=SETTINGS)] == ["terminal"]
    beyond = drive_along(np.array([[0.0, 0.0], [3.0, math.nextafter(4.0, 5.0)]]))
    assert [one.kind for one in segment(beyond, settings=SETTINGS)] == ["scenario"]


@given(st.integers(0, 2**32 - 1), st.integers(2, 3000), st.integers(0, 10**6))
def test_scenarios_cover_the_trajectory_once(seed: int, count: int, first_step: int) -> None:
    points = wandering(seed, count)
    rng = np.random.default_rng(seed)
    speed = rng.uniform(-0.3, 0.7, count)
    found = segment(drive_along(points, speed=speed, first_step=first_step), settings=SETTINGS)
    assert found[0].first_step == first_step
    assert found[-1].last_step == first_step + count - 1
    for before, after in pairwise(found):
        assert before.kind == "scenario"
        assert after.first_step == before.last_step
        assert after.start_stamp_ns > before.start_stamp_ns
    assert sum(one.negative_velocity_count or 0 for one in found) == (speed[1:] < 0).sum()
    assert sum(one.not_forward_count or 0 for one in found) == (speed[1:] <= 0.05).sum()


@given(st.integers(0, 2**32 - 1), st.integers(2, 3000))
def test_only_the_closing_step_is_farther_than_five_metres(seed: int, count: int) -> None:
    points = wandering(seed, count)
    for one in segment(drive_along(points), settings=SETTINGS):
        steps = points[one.first_step : one.last_step + 1]
        away = np.hypot(*(steps - steps[0]).T)
        assert (away[:-1] <= 5.0).all()
        assert (away[-1] > 5.0) == (one.kind == "scenario")


def test_cuts_equal_those_of_algorithm_2_written_out() -> None:
    for seed in range(20):
        points = wandering(seed, 2000)
        initial, expected = 0, []
        for step in range(len(points)):
            if float(np.linalg.norm(points[step] - points[initial])) > 5.0:
                expected.append(step)
                initial = step
        assert closing_steps(points, 5.0).tolist() == expected


def test_the_closing_step_is_counted_by_the_scenario_it_closes() -> None:
    points = np.array([[0.0, 0.0], [5.1, 0.0], [10.3, 0.0]])
    found = segment(drive_along(points, speed=np.array([-1.0, -1.0, 0.5])), settings=SETTINGS)
    assert [one.negative_velocity_count for one in found] == [1, 0]


def test_counts_lengths_and_seconds_are_those_driven() -> None:
    points = straight(5.2, steps_per_metre=10)
    speed = np.full(len(points), 0.5)
    speed[[3, 4, 5]] = -0.2
    speed[[7, 8]] = 0.05
    first = segment(drive_along(points, speed=speed), settings=SETTINGS)[0]
    assert first.negative_velocity_count == 3
    assert first.not_forward_count == 5
    assert first.reversing_s == pytest.approx(0.15)
    assert first.arc_length_m == pytest.approx(distance(first))
    assert first.duration_s == pytest.approx(0.05 * first.last_step)


def test_without_a_clock_counts_and_durations_are_unknown() -> None:
    found = segment(
        drive_along(straight(5.2), speed=np.full(209, -1.0), has_clock=False), settings=SETTINGS
    )
    assert found[0].negative_velocity_count is None
    assert found[0].not_forward_count is None
    assert found[0].reversing_s is None
    assert math.isnan(found[0].duration_s)


@pytest.mark.parametrize(("unknown", "is_counted"), [(4, True), (5, False)])
def test_counts_are_unknown_beyond_a_fiftieth_of_unknown_steps(
    unknown: int, is_counted: bool
) -> None:
    points = straight(5.025)  # 201 steps after the first
    speed = np.full(len(points), -0.5)
    speed[1 : 1 + unknown] = np.nan
    found = segment(drive_along(points, speed=speed), settings=SETTINGS)[0]
    steps = found.last_step
    assert steps == 201
    assert found.negative_velocity_count == (steps - unknown if is_counted else None)


def test_a_rest_says_how_it_ended() -> None:
    moving = drive_along(straight(2.0))
    standing = drive_along(np.concatenate((straight(2.0), np.tile([2.0, 0.0], (30, 1)))))
    assert segment(moving, settings=SETTINGS)[-1].outcome == "moving"
    assert segment(standing, settings=SETTINGS)[-1].outcome == "stopped"
    assert segment(standing, settings=SETTINGS, ends_in_cut=True)[-1].outcome == "cut"


def test_one_step_is_no_segment_and_no_rest_follows_a_final_cut() -> None:
    assert segment(drive_along(np.zeros((1, 2))), settings=SETTINGS) == []
    exact = segment(drive_along(np.array([[0.0, 0.0], [5.1, 0.0]])), settings=SETTINGS)
    assert [one.kind for one in exact] == ["scenario"]
