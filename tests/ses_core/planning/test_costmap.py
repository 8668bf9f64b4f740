"""Marks, clearing, distances and inflated costs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt

from ses_core.arrays import BoolArray
from ses_core.geometry import Pose2D
from ses_core.planning.costmap import (
    RESOLUTION_M,
    _note_change,
    inflation_costs,
    refresh_distances,
    work_in_scan,
)
from ses_core.robot_profile import LaserProfile, RobotProfile
from ses_core.simulation.sensing import sense
from tests.simulated import Kernel, course, get, hall, kernel, put, simulator


def _marks(k: Kernel) -> BoolArray:
    shape = (int(get(k.slot, "map_height")), int(get(k.slot, "map_width")))
    return k.memory.marks[: shape[0] * shape[1]].reshape(shape) > 0


def _mark_at(k: Kernel, x: float, y: float) -> tuple[int, int]:
    return (
        int((y - get(k.slot, "map_y")) / RESOLUTION_M),
        int((x - get(k.slot, "map_x")) / RESOLUTION_M),
    )


def _sense(k: Kernel) -> None:
    sense(k.slot, k.memory, 0, k.robot, k.setup, k.scratch, 0)


def test_costs_are_those_of_costmap_2d() -> None:
    costs = np.zeros(256, dtype=np.float32)
    inflation_costs(costs, 0.6, 0.265)
    assert costs[0] == 254
    assert costs[1] == 253
    assert costs[25] == 253  # 0.25 m: within the inscribed radius
    assert costs[36] == math.floor(252 * math.exp(-10.0 * (0.3 - 0.265)))
    assert costs[144] == math.floor(252 * math.exp(-10.0 * (0.6 - 0.265)))
    assert costs[145] == 0
    assert costs[255] == 0


def test_nothing_is_inflated_beyond_a_radius_smaller_than_the_inscribed_one() -> None:
    costs = np.zeros(256, dtype=np.float32)
    inflation_costs(costs, 0.1, 0.265)
    assert costs[4] == 253
    assert costs[5] == 0


@settings(deadline=None, max_examples=25)
@given(
    st.lists(
        st.lists(st.tuples(st.integers(0, 120), st.integers(0, 120)), max_size=12),
        min_size=1,
        max_size=3,
    ),
    st.booleans(),
)
def test_distances_refreshed_change_by_change_are_exact(
    changes: list[list[tuple[int, int]]], at_far_end: bool
) -> None:
    k = kernel(simulator(course(hall(length=7.0, width=6.0), goal=(6.0, 2.5))))
    width, height = int(get(k.slot, "map_width")), int(get(k.slot, "map_height"))
    k.memory.marks[:] = 0
    k.memory.distances[:] = 255
    for flips in changes:
        for near_row, near_column in flips:
            # One scan changes 124 cells at most; either end of the map is among them.
            row = height - 1 - near_row if at_far_end else near_row
            column = width - 1 - near_column if at_far_end else near_column
            index = row * width + column
            k.memory.marks[index] ^= 1
            _note_change(k.slot, index)
        refresh_distances(k.slot, k.memory, k.scratch, 0)
        marks = _marks(k)
        if marks.any():
            expected = np.minimum(np.rint(distance_transform_edt(~marks) ** 2), 255)
        else:
            expected = np.full((height, width), 255.0)
        np.testing.assert_array_equal(k.memory.distances.reshape(height, width), expected)


def test_walls_within_2_5_m_are_marked_and_farther_ones_are_not() -> None:
    k = kernel(simulator(course(hall())))
    marks = _marks(k)
    rows, columns = np.nonzero(marks)
    x = get(k.slot, "map_x") + (columns + 0.5) * RESOLUTION_M
    y = get(k.slot, "map_y") + (rows + 0.5) * RESOLUTION_M
    away = np.hypot(x - 1.0, y - 2.5)
    assert away.max() < 2.5 + RESOLUTION_M
    # Every mark lies on the wall's face or in the cell behind it.
    depth = np.min([x, np.abs(y - 0.0), 5.0 - y], axis=0)
    assert np.all(depth < 0.1 + RESOLUTION_M)
    assert marks[_mark_at(k, 1.0, 4.92)]
    # Behind the robot, where the laser does not look, nothing is known.
    assert not marks[_mark_at(k, 0.08, 2.5)]


def test_a_vanished_obstacle_is_cleared_by_beams_that_pass_through_it() -> None:
    k = kernel(simulator(course(hall())))
    index = _mark_at(k, 2.5, 2.5)
    flat = index[0] * int(get(k.slot, "map_width")) + index[1]
    k.memory.marks[flat] = 1
    _note_change(k.slot, flat)
    refresh_distances(k.slot, k.memory, k.scratch, 0)
    _sense(k)
    assert not _marks(k)[index]
    assert k.memory.distances[flat] > 100


def test_a_beam_without_a_return_neither_marks_nor_clears() -> None:
    k = kernel(simulator(course(hall())))
    index = _mark_at(k, 2.5, 2.5)
    flat = index[0] * int(get(k.slot, "map_width")) + index[1]
    k.memory.marks[flat] = 1
    before = _marks(k).copy()
    nothing = np.full(720, np.inf, dtype=np.float32)
    work_in_scan(k.slot, k.memory, nothing, k.robot, k.scratch.queue[0], True)
    np.testing.assert_array_equal(_marks(k), before)


@pytest.mark.parametrize("clears", [True, False])
def test_marks_under_the_padded_footprint_are_forgotten_by_setting(clears: bool) -> None:
    k = kernel(simulator(course(hall())))
    inside, outside = _mark_at(k, 0.75, 2.5), _mark_at(k, 0.6, 2.5)
    for row, column in (inside, outside):
        k.memory.marks[row * int(get(k.slot, "map_width")) + column] = 1
    nothing = np.full(720, np.inf, dtype=np.float32)
    work_in_scan(k.slot, k.memory, nothing, k.robot, k.scratch.queue[0], clears)
    assert _marks(k)[inside] != clears
    assert _marks(k)[outside]


def test_a_still_robot_without_noise_changes_nothing_by_looking_again() -> None:
    k = kernel(simulator(course(hall())))
    work_in_scan(k.slot, k.memory, k.memory.scans[0], k.robot, k.scratch.queue[0], True)
    assert get(k.slot, "changed_right") == -1


def test_the_window_is_the_map_around_the_robot_and_lethal_beyond_it() -> None:
    k = kernel(simulator(course(hall())))
    window = k.memory.window_distances[0]
    column, row = int(get(k.slot, "window_column")), int(get(k.slot, "window_row"))
    width = int(get(k.slot, "map_width"))
    there = _mark_at(k, 2.0, 4.0)
    inside = window[there[0] - row + 1, there[1] - column + 1]
    assert inside == k.memory.distances[there[0] * width + there[1]]
    assert np.all(window[:, 0] == 0)
    assert np.all(window[: -row - 1] == 0)


def test_positions_outside_the_map_are_ignored() -> None:
    k = kernel(simulator(course(hall())))
    put(k.slot, x=-40.0)
    work_in_scan(k.slot, k.memory, k.memory.scans[0], k.robot, k.scratch.queue[0], False)
    assert get(k.slot, "changed_right") == -1


_MOUNTED = RobotProfile(
    name="mounted",
    laser=LaserProfile(
        beams=120,
        angle_min_rad=-math.pi,
        angle_max_rad=math.pi - 2.0 * math.pi / 120,
        range_max_m=12.0,
        mount_x_m=0.12,
        mount_y_m=-0.07,
        mount_yaw_rad=2.0,
    ),
)


def _beam_ends(k: Kernel, reach: float) -> list[tuple[float, float, float, float, float]]:
    """Origin, unit direction and range (cut at `reach`) of every beam in map cells."""
    laser, yaw = _MOUNTED.laser, get(k.slot, "yaw")
    turn = complex(math.cos(yaw), math.sin(yaw))
    eye = complex(get(k.slot, "x"), get(k.slot, "y")) + turn * complex(
        laser.mount_x_m, laser.mount_y_m
    )
    eye = (eye - complex(get(k.slot, "map_x"), get(k.slot, "map_y"))) / 0.05
    angles = yaw + laser.mount_yaw_rad + np.linspace(-math.pi, math.pi, 121)[:-1]
    return [
        (eye.real, eye.imag, math.cos(angle), math.sin(angle), min(float(length), reach) / 0.05)
        for angle, length in zip(angles, k.memory.scans[0], strict=True)
        if math.isfinite(length)
    ]


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 1000), st.floats(-math.pi, math.pi))
def test_a_mounted_round_laser_marks_its_hits_and_clears_what_its_beams_step_through(
    seed: int, yaw: float
) -> None:
    rng = np.random.default_rng(seed)
    cells = hall() | (rng.random((50, 90)) < 0.02)
    cells[20:31, 35:46] = False
    task = course(cells, start=Pose2D(4.05, 2.55, yaw))
    k = kernel(simulator(task, profile=_MOUNTED))
    width, height = int(get(k.slot, "map_width")), int(get(k.slot, "map_height"))
    # Something else was marked before; the robot sees through some of it.
    k.memory.marks[:] = rng.random(k.memory.marks.shape) < 0.05
    nearest = distance_transform_edt(k.memory.marks[: width * height].reshape(height, width) == 0)
    k.memory.distances[: width * height] = np.minimum(np.rint(nearest**2), 255).ravel()
    marks = k.memory.marks[: width * height].reshape(height, width).astype(bool)
    for x, y, along_x, along_y, length in _beam_ends(k, 3.0):
        pace = max(abs(along_x), abs(along_y))
        for step in range(int(length * pace) + 1):
            row, column = int(y + step * along_y / pace), int(x + step * along_x / pace)
            if 0 <= row < height and 0 <= column < width:
                marks[row, column] = False
    for x, y, along_x, along_y, length in _beam_ends(k, 3.0):
        if length < 2.5 / 0.05:
            marks[int(y + length * along_y), int(x + length * along_x)] = True
    work_in_scan(k.slot, k.memory, k.memory.scans[0], k.robot, k.scratch.queue[0], False)
    found = k.memory.marks[: width * height].reshape(height, width) > 0
    # Rounding may put a point that lies on a cell's edge into its neighbour.
    assert np.count_nonzero(found != marks) <= 2
