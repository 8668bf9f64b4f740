"""Cells and metres."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ses_core.occupancy import (
    ENVIRONMENT_CELLS,
    ENVIRONMENT_RESOLUTION_M,
    OccupancyGrid,
    cell_centres,
    cell_indices,
    draw,
    environment_cell_centres,
    environment_course,
    environment_to_grid,
    from_drawing,
    grid_to_environment,
    occupied_at,
)

seeds = st.integers(0, 2**32 - 1)


def random_cells(seed: int) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    return np.random.default_rng(seed).random((ENVIRONMENT_CELLS, ENVIRONMENT_CELLS)) < 0.3


@given(seeds)
def test_environment_to_grid_and_back_is_the_identity(seed: int) -> None:
    cells = random_cells(seed)
    assert (grid_to_environment(environment_to_grid(cells)) == cells).all()


@given(seeds)
def test_each_cell_is_found_at_its_own_centre_in_grid_and_course(seed: int) -> None:
    cells = random_cells(seed)
    centres = environment_cell_centres().reshape(-1, 2)
    for grid in (environment_to_grid(cells), environment_course(cells)):
        assert (occupied_at(grid, centres).reshape(cells.shape) == cells).all()


def test_the_picture_has_the_goal_on_top_and_left_on_the_left() -> None:
    cells = np.zeros((30, 30), dtype=np.bool_)
    cells[0, 0] = True
    grid = environment_to_grid(cells)
    ahead_left = np.array([[4.95, 2.45]])
    assert occupied_at(grid, ahead_left)[0]
    assert grid.cells.sum() == 1


def test_a_course_is_walled_all_round_and_open_at_both_ends() -> None:
    course = environment_course(np.zeros((30, 30), dtype=np.bool_))
    edge = course.cells.copy()
    edge[1:-1, 1:-1] = True
    assert edge.all()
    assert not course.cells[1:-1, 1:-1].any()
    inside = np.array([[-0.99, 0.0], [5.99, 0.0], [2.5, 2.49]])
    assert not occupied_at(course, inside).any()
    outside = np.array([[-1.01, 0.0], [6.01, 0.0], [2.5, 2.51]])
    assert occupied_at(course, outside).all()


def test_indices_and_centres_agree_for_a_grid_with_an_origin() -> None:
    grid = OccupancyGrid(cells=np.zeros((3, 4), dtype=np.bool_), resolution=0.5, origin=(-1, 2))
    indices = np.array([[0, 0], [3, 2]])
    centres = cell_centres(grid, indices)
    assert centres.tolist() == [[-0.75, 2.25], [0.75, 3.25]]
    assert (cell_indices(grid, centres) == indices).all()
    assert (grid.width_m, grid.height_m) == (2.0, 1.5)


def test_points_beyond_the_map_get_the_answer_for_outside() -> None:
    grid = OccupancyGrid(cells=np.zeros((2, 2), dtype=np.bool_), resolution=1.0)
    beyond = np.array([[-0.1, 0.5], [2.1, 0.5], [0.5, -0.1], [0.5, 2.1]])
    assert occupied_at(grid, beyond).all()
    assert not occupied_at(grid, beyond, outside=False).any()


def test_text_to_cells_to_text_is_the_identity() -> None:
    drawing = "##.##\n#...#\n##.##"
    assert draw(from_drawing(drawing)) == drawing


def test_a_ragged_drawing_is_refused() -> None:
    with pytest.raises(ValueError, match=r"lengths \[2, 3\]"):
        from_drawing("##\n###")


@pytest.mark.parametrize("resolution", [0.0, -1.0, float("nan")])
def test_a_grid_without_a_resolution_is_refused(resolution: float) -> None:
    with pytest.raises(ValueError, match="resolution"):
        OccupancyGrid(cells=np.zeros((2, 2), dtype=np.bool_), resolution=resolution)


def test_the_cell_size_is_a_thirtieth_of_five_metres() -> None:
    assert pytest.approx(5.0 / 30.0) == ENVIRONMENT_RESOLUTION_M
