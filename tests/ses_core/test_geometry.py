"""Poses and frames."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ses_core.geometry import (
    Pose2D,
    compose,
    compose_all,
    from_frame,
    inverse,
    to_frame,
    wrap_angle,
    wrap_angles,
)

finite = st.floats(-100.0, 100.0)
poses = st.builds(Pose2D, finite, finite, st.floats(-math.pi, math.pi))


@given(st.floats(-1e4, 1e4))
def test_a_wrapped_angle_lies_in_the_half_open_interval_and_points_the_same_way(
    angle: float,
) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped - angle) == pytest.approx(1.0, abs=1e-9)
    assert wrap_angles(np.array([angle]))[0] == pytest.approx(wrapped, abs=1e-9) or (
        abs(abs(wrapped) - math.pi) < 1e-9
    )


def test_half_a_turn_is_plus_pi_from_either_side() -> None:
    assert wrap_angle(-math.pi) == math.pi
    assert wrap_angles(np.array([-math.pi, math.pi, 3 * math.pi])).tolist() == [math.pi] * 3


@given(poses)
def test_a_pose_composed_with_its_inverse_is_the_origin(pose: Pose2D) -> None:
    nothing = compose(pose, inverse(pose))
    assert (nothing.x, nothing.y) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert math.cos(nothing.yaw) == pytest.approx(1.0)


@given(poses, poses)
def test_composing_one_pose_or_many_gives_the_same(outer: Pose2D, inner: Pose2D) -> None:
    one = compose(outer, inner)
    many = compose_all(np.array([[outer.x, outer.y, outer.yaw]]), inner)
    assert many[0, :2] == pytest.approx((one.x, one.y), abs=1e-9)
    assert math.cos(many[0, 2] - one.yaw) == pytest.approx(1.0)


@given(poses, st.lists(st.tuples(finite, finite), min_size=1, max_size=5))
def test_a_change_of_frame_is_undone_by_its_reverse(
    frame: Pose2D, points: list[tuple[float, float]]
) -> None:
    array = np.array(points)
    assert from_frame(to_frame(array, frame), frame) == pytest.approx(array, abs=1e-6)


def test_a_point_ahead_lies_on_the_x_axis_of_the_robots_frame() -> None:
    robot = Pose2D(1.0, 2.0, math.pi / 2)
    assert to_frame(np.array([[1.0, 5.0]]), robot)[0] == pytest.approx((3.0, 0.0), abs=1e-12)
    assert from_frame(np.array([[3.0, 0.0]]), robot)[0] == pytest.approx((1.0, 5.0), abs=1e-12)
