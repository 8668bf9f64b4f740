import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ses_core.arrays import FloatArray
from ses_core.extraction.transforms import chain, planar_mount, transform_matrix
from ses_core.geometry import Pose2D, compose

ANGLES = st.floats(-3.0, 3.0)
LENGTHS = st.floats(-5.0, 5.0)
POSES = st.builds(Pose2D, LENGTHS, LENGTHS, ANGLES)


def matrix_of(pose: Pose2D, height: float = 0.0) -> FloatArray:
    turn = (0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2))
    matrix = transform_matrix((pose.x, pose.y, height), turn)
    assert matrix is not None
    return matrix


@given(POSES, POSES)
def test_a_chain_in_the_plane_composes_as_planar_poses_do(first: Pose2D, second: Pose2D) -> None:
    transforms = {
        ("base", "shell"): matrix_of(first, 0.1),
        ("shell", "laser"): matrix_of(second, 0.2),
    }
    matrix = chain(transforms, "base", "laser")
    assert matrix is not None
    expected, found = compose(first, second), planar_mount(matrix).pose
    assert math.isclose(found.x, expected.x, abs_tol=1e-9)
    assert math.isclose(found.y, expected.y, abs_tol=1e-9)
    assert math.isclose(math.cos(found.yaw), math.cos(expected.yaw), abs_tol=1e-9)
    assert math.isclose(math.sin(found.yaw), math.sin(expected.yaw), abs_tol=1e-9)


def test_a_transform_is_used_backwards_where_the_tree_runs_the_other_way() -> None:
    pose = Pose2D(1.0, 2.0, 0.5)
    matrix = chain({("laser", "base"): matrix_of(pose)}, "base", "laser")
    assert matrix is not None
    np.testing.assert_allclose(matrix @ matrix_of(pose), np.eye(4), atol=1e-12)


def test_frames_without_a_way_between_them_have_no_transform() -> None:
    assert chain({("odom", "base"): np.eye(4)}, "base", "laser") is None


def test_a_laser_upside_down_counts_its_angles_the_other_way() -> None:
    rolled = transform_matrix((0.1, 0.0, 0.2), (1.0, 0.0, 0.0, 0.0))
    assert rolled is not None
    mount = planar_mount(rolled)
    assert mount.is_upside_down
    assert mount.pose == Pose2D(0.1, 0.0, 0.0)
    beam = 0.7
    seen = rolled[:2, :2] @ (math.cos(beam), math.sin(beam))
    np.testing.assert_allclose(seen, (math.cos(-beam), math.sin(-beam)))


def test_a_quaternion_of_any_length_turns_but_none_and_nan_do_not() -> None:
    long = transform_matrix((0.0, 0.0, 0.0), (0.0, 0.0, 3.0, 3.0))
    assert long is not None
    np.testing.assert_allclose(long[:2, :2], [[0, -1], [1, 0]], atol=1e-12)
    assert transform_matrix((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)) is None
    assert transform_matrix((0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0)) is None
    assert transform_matrix((math.inf, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)) is None
