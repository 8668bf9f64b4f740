import numpy as np
import pytest
from scipy import ndimage

from ses_core.arrays import BoolArray
from ses_core.occupancy import occupied_at
from ses_core.worlds.cellular_automata import (
    COURSE_GOAL,
    COURSE_START,
    PARAMETER_SETS,
    barn_course,
    cross_field,
    generate_barn,
    generate_barn_world,
    grow_field,
    smooth_path,
)


def _smoothed_cell_by_cell(field: BoolArray) -> BoolArray:
    """The rules once more, written as slowly as they read."""
    smoothed = field.copy()
    for row in range(30):
        for column in range(30):
            filled = 0
            for r in (row - 1, row, row + 1):
                for c in (column - 1, column, column + 1):
                    if (r, c) == (row, column):
                        continue
                    if r < 0 or r > 29:
                        filled += 1
                    elif 0 <= c <= 29:
                        filled += int(field[r, c])
            if filled >= 5:
                smoothed[row, column] = True
            elif filled <= 1:
                smoothed[row, column] = False
    smoothed[[0, -1]] = True
    return smoothed


def test_smoothing_follows_the_rules_cell_by_cell() -> None:
    fresh = grow_field(0.25, 0, rng=np.random.default_rng(4))
    once = grow_field(0.25, 1, rng=np.random.default_rng(4))
    twice = grow_field(0.25, 2, rng=np.random.default_rng(4))
    assert np.array_equal(once, _smoothed_cell_by_cell(fresh))
    assert np.array_equal(twice, _smoothed_cell_by_cell(once))


def test_a_world_does_not_depend_on_how_many_are_generated() -> None:
    alone = generate_barn_world(2, seed=11)
    among = generate_barn(3, seed=11)[2]
    assert alone.world.world_id == among.world.world_id
    assert np.array_equal(alone.path, among.path)


def test_seeds_and_indices_give_different_worlds() -> None:
    worlds = [*generate_barn(3, seed=1), generate_barn_world(0, seed=2)]
    assert len({generated.world.world_id for generated in worlds}) == 4


def test_the_twelve_parameter_sets_follow_each_other() -> None:
    generated = generate_barn_world(14, seed=0)
    assert (generated.fill, generated.smoothing) == PARAMETER_SETS[2]


@pytest.mark.parametrize("index", range(6))
def test_a_path_keeps_two_cells_from_obstacles_and_turns_gently(index: int) -> None:
    generated = generate_barn_world(index, seed=5)
    path = generated.path
    distance = ndimage.distance_transform_cdt(~generated.field, "chessboard")
    assert distance[path[:, 0], path[:, 1]].min() >= 3
    assert (path[0, 1], path[-1, 1]) == (0, 29)
    steps = np.diff(path, axis=0)
    assert np.abs(steps).max() == 1
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.abs(np.remainder(np.diff(headings) + np.pi, 2 * np.pi) - np.pi)
    assert turns.max(initial=0.0) <= np.pi / 4 + 1e-9


def test_a_field_with_a_wall_across_cannot_be_crossed() -> None:
    field = np.zeros((30, 30), dtype=np.bool_)
    field[[0, -1]] = True
    assert cross_field(field, rng=np.random.default_rng(0)) is not None
    field[:, 15] = True
    assert cross_field(field, rng=np.random.default_rng(0)) is None
    field[10:15, 15] = False
    assert cross_field(field, rng=np.random.default_rng(0)) is not None
    field[10, 15] = True
    assert cross_field(field, rng=np.random.default_rng(0)) is None


def test_a_path_turns_by_at_most_45_degrees_per_cell() -> None:
    blocked = np.ones((30, 30), dtype=np.bool_)
    blocked[5, :10] = blocked[7, :10] = False
    # One cell joins the two lanes: whoever turns back in it turns by 90 degrees at once.
    blocked[6, 10] = False
    assert smooth_path(blocked, (5, 0), (7, 0)) is None
    # A room at the end of the lanes is wide enough to turn in steps of 45 degrees.
    blocked[5:9, 10:13] = False
    path = smooth_path(blocked, (5, 0), (7, 0))
    assert path is not None
    assert path[0].tolist() == [5, 0]
    assert path[-1].tolist() == [7, 0]


def test_a_course_is_a_walled_corridor_a_field_and_open_ground() -> None:
    field = np.zeros((30, 30), dtype=np.bool_)
    field[3, 7] = True
    grid = barn_course(field)
    points = np.array(
        [
            (COURSE_START.x, COURSE_START.y),
            COURSE_GOAL,
            (-4.425, 2.0),  # corridor, left wall
            (-0.075, 2.0),  # corridor, right wall
            (-2.25, 0.075),  # corridor, back wall
            (-4.425 + 3 * 0.15, 5.175 + 7 * 0.15),  # the one cell of the field
            (-4.425 + 3 * 0.15, 5.175 + 8 * 0.15),
        ]
    )
    assert occupied_at(grid, points).tolist() == [False, False, True, True, True, True, False]
