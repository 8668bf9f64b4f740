"""Ray casting against brute force."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import distance_transform_cdt

from ses_core.arrays import BoolArray
from ses_core.geometry import Pose2D
from ses_core.robot_profile import LaserProfile, RobotProfile
from ses_core.simulation.lidar import cast, cast_scan, chessboard_clearance
from tests.simulated import course, hall, simulator

grids = arrays(np.bool_, st.tuples(st.integers(1, 14), st.integers(1, 14)))


@settings(deadline=None, max_examples=60)
@given(grids)
def test_clearance_is_the_chessboard_distance(occupied: BoolArray) -> None:
    clearance = chessboard_clearance(occupied)
    if occupied.any():
        expected = distance_transform_cdt(~occupied, metric="chessboard")
        np.testing.assert_array_equal(clearance, expected)
    else:
        assert np.all(clearance == 255)


def _walk(occupied: BoolArray, x: float, y: float, angle: float) -> float:
    """Meet every cell face on the ray in turn; no leaps."""
    along = (math.cos(angle), math.sin(angle))
    height, width = occupied.shape
    faces = sorted(
        (face - position) / direction
        for position, direction, size in ((x, along[0], width), (y, along[1], height))
        if direction != 0.0
        for face in range(size + 1)
        if (face - position) / direction > 0.0
    )
    reached = 0.0
    for face in [*faces, math.inf]:
        middle = 0.5 * (reached + face)
        column = math.floor(x + along[0] * middle) if face < math.inf else -1
        row = math.floor(y + along[1] * middle) if face < math.inf else -1
        if not (0 <= column < width and 0 <= row < height) or occupied[row, column]:
            return reached
        reached = face
    return reached


@settings(deadline=None, max_examples=300)
@given(grids, st.floats(0.01, 0.99), st.floats(0.01, 0.99), st.floats(-math.pi, math.pi))
def test_a_ray_meets_the_same_face_as_a_walk_from_face_to_face(
    occupied: BoolArray, share_x: float, share_y: float, angle: float
) -> None:
    height, width = occupied.shape
    x, y = 1.0 + share_x * width, 1.0 + share_y * height
    occupied = np.pad(occupied, 1, constant_values=True)
    height, width = occupied.shape
    clearance = chessboard_clearance(occupied)
    distance = cast(
        clearance.ravel(), 0, width, height, x, y, math.cos(angle), math.sin(angle), 1e3
    )
    if occupied[int(y), int(x)]:
        assert distance == 0.0
        return
    # Where a ray all but touches a corner the two may take either side of it.
    near_by = [_walk(occupied, x, y, angle + turn) for turn in (-1e-9, 0.0, 1e-9)]
    assert min(abs(distance - walked) for walked in near_by) < 1e-6


@settings(deadline=None, max_examples=40)
@given(
    st.integers(0, 1000),
    st.floats(-math.pi, math.pi),
    st.floats(-0.3, 0.3),
    st.floats(-0.3, 0.3),
    st.floats(-math.pi, math.pi),
)
def test_a_round_laser_sees_from_where_it_is_mounted(
    seed: int, yaw: float, mount_x: float, mount_y: float, mount_yaw: float
) -> None:
    cells = hall() | (np.random.default_rng(seed).random((50, 90)) < 0.02)
    cells[20:31, 35:46] = False
    laser = LaserProfile(
        beams=90,
        angle_min_rad=-math.pi,
        angle_max_rad=math.pi - 2.0 * math.pi / 90,
        range_max_m=3.0,
        mount_x_m=mount_x,
        mount_y_m=mount_y,
        mount_yaw_rad=mount_yaw,
    )
    task = course(cells, start=Pose2D(4.05, 2.55, yaw))
    ranges = simulator(task, profile=RobotProfile(name="round", laser=laser)).scans()[0]
    eye_x = 4.05 + mount_x * math.cos(yaw) - mount_y * math.sin(yaw)
    eye_y = 2.55 + mount_x * math.sin(yaw) + mount_y * math.cos(yaw)
    for beam, found in enumerate(ranges):
        angle = yaw + mount_yaw - math.pi + beam * 2.0 * math.pi / 90
        walked = [
            0.1 * _walk(cells, eye_x / 0.1, eye_y / 0.1, angle + turn)
            for turn in (-1e-7, 0.0, 1e-7)
        ]
        expected = [length if 0.1 <= length <= 3.0 else math.inf for length in walked]
        assert any(math.isclose(found, length, abs_tol=1e-4) for length in expected)


def test_readings_outside_the_sensor_s_limits_are_no_returns() -> None:
    occupied = np.zeros((40, 40), dtype=np.bool_)
    occupied[:, [0, -1]] = True
    occupied[[0, -1], :] = True
    clearance = chessboard_clearance(occupied)
    beams = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]])
    ranges = np.zeros(3, dtype=np.float32)
    cast_scan(ranges, clearance.ravel(), 0, 40, 40, 0.1, 0.15, 2.0, 0.0, beams, 0.1, 3.0)
    # Ahead 3.75 m to the wall, behind 0.05 m, to the left 1.9 m.
    np.testing.assert_allclose(ranges, [np.inf, np.inf, 1.9], rtol=1e-6)


def test_beams_turn_with_the_robot() -> None:
    occupied = np.zeros((40, 40), dtype=np.bool_)
    occupied[:, -1] = True
    clearance = chessboard_clearance(occupied)
    ranges = np.zeros(1, dtype=np.float32)
    beams = np.array([[0.0, 1.0]])
    cast_scan(ranges, clearance.ravel(), 0, 40, 40, 0.1, 2.0, 2.0, -math.pi / 2, beams, 0.1, 30.0)
    np.testing.assert_allclose(ranges, [1.9], rtol=1e-6)
