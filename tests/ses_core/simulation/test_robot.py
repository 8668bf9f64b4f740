"""The robot's numbers, motion and contact."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ses_core.robot_profile import JACKAL, TURTLEBOT4, RobotProfile
from ses_core.simulation.lidar import chessboard_clearance
from ses_core.simulation.robot import approach, drive, robot_model, touches, wrap


def test_outline_of_the_jackal_has_16_points_on_its_padded_footprint() -> None:
    outline = robot_model(JACKAL).outline
    assert len(outline) == 16
    on_long_side = np.isclose(np.abs(outline[:, 1]), 0.265)
    on_short_side = np.isclose(np.abs(outline[:, 0]), 0.31)
    assert np.all(on_long_side | on_short_side)
    gaps = np.hypot(*(np.roll(outline, -1, axis=0) - outline).T)
    assert gaps.max() <= 0.165


def test_a_round_robot_has_at_least_14_outline_points() -> None:
    outline = robot_model(TURTLEBOT4).outline
    assert len(outline) >= 14
    assert np.all(np.hypot(*outline.T) <= 0.219 + 1e-9)


def test_a_footprint_that_is_not_convex_is_refused() -> None:
    corners = ((0.3, 0.3), (0.0, 0.05), (-0.3, 0.3), (-0.3, -0.3), (0.3, -0.3))
    with pytest.raises(ValueError, match="'dented' is not convex"):
        robot_model(RobotProfile(name="dented", footprint_m=corners))


def test_clockwise_and_counter_clockwise_footprints_are_one_body() -> None:
    turned = RobotProfile(footprint_m=JACKAL.footprint_m[::-1])
    np.testing.assert_allclose(
        np.sort(robot_model(turned).body_sides, axis=0),
        np.sort(robot_model(JACKAL).body_sides, axis=0),
    )


@settings(deadline=None)
@given(st.floats(-2.0, 2.0), st.floats(-4.0, 4.0), st.floats(-3.0, 3.0))
def test_driving_equals_many_small_straight_steps(v: float, w: float, yaw: float) -> None:
    steps = 20_000
    headings = yaw + w * (np.arange(steps) + 0.5) / steps
    x, y, turned = drive(0.0, 0.0, yaw, v, w, 1.0)
    assert x == pytest.approx(float(np.mean(v * np.cos(headings))), abs=1e-6)
    assert y == pytest.approx(float(np.mean(v * np.sin(headings))), abs=1e-6)
    assert turned == pytest.approx(yaw + w)


def test_wrapping_keeps_pi_and_turns_minus_pi() -> None:
    assert wrap(math.pi) == pytest.approx(math.pi)
    assert wrap(-math.pi) == pytest.approx(math.pi)
    assert wrap(3.0 * math.pi + 0.1) == pytest.approx(-math.pi + 0.1)


def test_velocity_approaches_its_target_by_the_limit() -> None:
    assert approach(0.0, 2.0, 0.5) == 0.5
    assert approach(0.4, 0.5, 0.5) == 0.5
    assert approach(0.5, -0.5, 0.5) == 0.0


@settings(deadline=None, max_examples=150)
@given(
    st.floats(0.6, 1.4),
    st.floats(0.6, 1.4),
    st.floats(-math.pi, math.pi),
    st.lists(st.tuples(st.integers(0, 19), st.integers(0, 19)), max_size=6),
)
def test_contact_is_that_of_points_sampled_all_over_the_body(
    x: float, y: float, yaw: float, places: list[tuple[int, int]]
) -> None:
    robot = robot_model(JACKAL)
    occupied = np.zeros((20, 20), dtype=np.bool_)
    for row, column in places:
        occupied[row, column] = True
    found = touches(robot, x, y, yaw, chessboard_clearance(occupied).ravel(), 0, 20, 20, 0.1)

    def sampled(grow: float) -> bool:
        along, across = np.meshgrid(
            np.linspace(-0.21 - grow, 0.21 + grow, 85), np.linspace(-0.165 - grow, 0.165 + grow, 67)
        )
        columns = np.floor((x + math.cos(yaw) * along - math.sin(yaw) * across) / 0.1)
        rows = np.floor((y + math.sin(yaw) * along + math.cos(yaw) * across) / 0.1)
        return bool(occupied[rows.astype(int), columns.astype(int)].any())

    # Samples 5 mm apart miss the tips of corners: grown and shrunk bodies bound the answer.
    assert sampled(-0.004) <= found <= sampled(0.006)


def test_leaving_the_world_is_contact() -> None:
    robot = robot_model(JACKAL)
    clearance = np.ones(400, dtype=np.uint8)
    assert not touches(robot, 0.25, 1.0, 0.0, clearance, 0, 20, 20, 0.1)
    assert touches(robot, 0.15, 1.0, 0.0, clearance, 0, 20, 20, 0.1)
    assert touches(robot, -1.0, 1.0, 0.0, clearance, 0, 20, 20, 0.1)
