"""Whether a disc gets through, against brute force on a fine lattice."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from ses_core.arrays import BoolArray
from ses_core.occupancy import ENVIRONMENT_RESOLUTION_M, environment_course
from ses_core.robot_profile import JACKAL
from ses_core.synthesis.traversability import node_clearance, shortest_path, traversable

RADIUS = JACKAL.inscribed_radius_m


def can_cross(cells: BoolArray, radius: float = RADIUS) -> bool:
    return bool(traversable(cells[None], radius=radius)[0])


def wall_with_gap(width: int, *, row: int = 15, left: int = 13) -> BoolArray:
    cells = np.zeros((30, 30), dtype=np.bool_)
    cells[row] = True
    cells[row, left : left + width] = False
    return cells


def scattered(seed: int) -> BoolArray:
    rng = np.random.default_rng(seed)
    cells = np.zeros((30, 30), dtype=np.bool_)
    for _ in range(rng.integers(5, 60)):
        row, column = rng.integers(0, 30, 2)
        height, width = rng.integers(1, 5, 2)
        cells[row : row + height, column : column + width] = True
    if rng.random() < 0.7:
        cells[-2:, 12:18] = False
        cells[:2, 12:18] = False
    return cells


def crosses_by_brute_force(cells: BoolArray, radius: float) -> bool:
    """Flood the points, 1 cm apart, that keep their distance to all points of all squares."""
    course = environment_course(cells)
    spacing = course.resolution / 16
    height, width = course.cells.shape
    occupied = np.zeros((height * 16 + 1, width * 16 + 1), dtype=np.bool_)
    for row, column in zip(*np.nonzero(course.cells), strict=True):
        occupied[row * 16 : row * 16 + 17, column * 16 : column * 16 + 17] = True
    free = ndimage.distance_transform_edt(~occupied) * spacing >= radius - 1e-9
    labels, _ = ndimage.label(free, structure=np.ones((3, 3)))
    start_x, start_y = -np.array(course.origin) / spacing
    goal_x = (5.0 - course.origin[0]) / spacing
    start = labels[round(start_y), round(start_x)]
    return bool(start != 0 and start == labels[round(start_y), round(goal_x)])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.12, 0.2, RADIUS, 0.35, 0.45]))
def test_answers_equal_those_of_brute_force(seed: int, radius: float) -> None:
    cells = scattered(seed)
    assert can_cross(cells, radius) == crosses_by_brute_force(cells, radius)


def test_three_cells_are_too_narrow_for_the_jackal_and_four_are_not() -> None:
    assert not can_cross(wall_with_gap(3))
    assert can_cross(wall_with_gap(4))


def test_a_gap_of_exactly_one_diameter_lets_the_disc_through() -> None:
    assert can_cross(wall_with_gap(3), 1.5 * ENVIRONMENT_RESOLUTION_M)
    assert not can_cross(wall_with_gap(3), 1.5 * ENVIRONMENT_RESOLUTION_M + 1e-6)


def test_the_sides_are_closed() -> None:
    along_the_side = wall_with_gap(3, left=0)
    assert not can_cross(along_the_side)
    assert can_cross(wall_with_gap(4, left=0))
    assert not can_cross(along_the_side[:, ::-1].copy())


def test_squares_that_touch_at_a_corner_are_a_wall() -> None:
    assert not can_cross(np.eye(30, dtype=np.bool_), 0.05)


def test_start_and_goal_need_room() -> None:
    empty = np.zeros((30, 30), dtype=np.bool_)
    assert can_cross(empty)
    for row in (0, 29):
        blocked = empty.copy()
        blocked[row, 14] = True
        assert not can_cross(blocked)
        # One column further its near side is 0.17 m away, another one 0.33 m.
        assert not can_cross(np.roll(blocked, -1, axis=1))
        assert can_cross(np.roll(blocked, -2, axis=1))


@given(st.integers(0, 2**32 - 1))
def test_mirrored_and_turned_places_are_crossed_alike(seed: int) -> None:
    cells = scattered(seed)
    turned = cells[::-1, ::-1].copy()
    assert can_cross(cells) == can_cross(cells[:, ::-1].copy()) == can_cross(turned)


@given(st.integers(0, 2**32 - 1))
def test_removing_an_obstacle_never_closes_a_place(seed: int) -> None:
    cells = scattered(seed)
    fewer = cells & (np.random.default_rng(seed).random(cells.shape) < 0.9)
    assert can_cross(fewer) or not can_cross(cells)


def test_a_stack_is_answered_one_by_one() -> None:
    stack = np.stack([scattered(seed) for seed in range(50)])
    answers = traversable(stack, radius=RADIUS)
    assert answers.tolist() == [can_cross(cells) for cells in stack]
    assert 5 < answers.sum() < 45
    assert traversable(stack[:0], radius=RADIUS).shape == (0,)


@pytest.mark.parametrize("radius", [0.0, -0.1, 0.5, math.nan])
def test_a_radius_that_cannot_be_answered_for_is_refused(radius: float) -> None:
    with pytest.raises(ValueError, match="inscribed radius"):
        traversable(np.zeros((1, 30, 30), dtype=np.bool_), radius=radius)


def test_cells_of_another_size_are_refused() -> None:
    with pytest.raises(ValueError, match=r"\(2, 20, 30\)"):
        traversable(np.zeros((2, 20, 30), dtype=np.bool_), radius=0.2)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_path_exists_where_the_place_can_be_crossed_and_keeps_its_distance(seed: int) -> None:
    cells = scattered(seed)
    path = shortest_path(cells, RADIUS)
    assert (path is not None) == can_cross(cells)
    if path is None:
        return
    assert np.allclose(path[[0, -1]], [[0.0, 0.0], [5.0, 0.0]], atol=1e-9)
    assert np.hypot(*np.diff(path, axis=0).T).max() < 0.03
    course = environment_course(cells)
    rows, columns = np.nonzero(course.cells)
    low = np.column_stack((columns, rows)) * course.resolution + course.origin
    gaps = np.maximum(np.maximum(low - path[:, None], path[:, None] - low - course.resolution), 0)
    assert np.hypot(gaps[..., 0], gaps[..., 1]).min() > RADIUS - 0.016


def test_the_shortest_way_through_nothing_is_straight() -> None:
    path = shortest_path(np.zeros((30, 30), dtype=np.bool_), RADIUS)
    assert path is not None
    assert np.abs(path[:, 1]).max() < 1e-9


def test_the_shortest_way_around_a_corner_has_the_length_of_a_taut_rope() -> None:
    # A wall across the middle from the left side to 1 m right of the centre line.
    cells = np.zeros((30, 30), dtype=np.bool_)
    cells[14:16, :21] = True
    path = shortest_path(cells, 0.2)
    assert path is not None
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    # Tangents to circles of 0.2 m around the corners (2.5 -+ 1/6, -1), and the straight between.
    reach = math.hypot(2.5 - 1 / 6, 1.0)
    tangent = math.sqrt(reach**2 - 0.2**2)
    angle = math.atan2(1.0, 2.5 - 1 / 6) + math.asin(0.2 / reach)
    assert length == pytest.approx(2 * (tangent + 0.2 * angle) + 1 / 3, abs=0.03)


def test_clearance_of_nodes_is_the_distance_to_the_nearest_square() -> None:
    course = environment_course(scattered(3))
    clearance = node_clearance(course)
    rng = np.random.default_rng(0)
    rows, columns = np.nonzero(course.cells)
    low = np.column_stack((columns, rows)) * course.resolution
    for _ in range(200):
        y, x = rng.integers(0, clearance.shape[0]), rng.integers(0, clearance.shape[1])
        point = np.array([x, y]) * course.resolution / 8
        gaps = np.maximum(np.maximum(low - point, point - low - course.resolution), 0)
        assert clearance[y, x] == pytest.approx(np.hypot(*gaps.T).min(), abs=1e-9)
