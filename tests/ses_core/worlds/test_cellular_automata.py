from collections import Counter

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
    parameter_set,
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


def test_every_dozen_has_all_parameter_sets_and_so_have_the_held_out_worlds() -> None:
    dozens = [{parameter_set(index) for index in range(12 * k, 12 * k + 12)} for k in range(25)]
    assert all(dozen == set(PARAMETER_SETS) for dozen in dozens)
    held_out = Counter(parameter_set(index) for index in range(0, 300, 6))
    assert set(held_out) == set(PARAMETER_SETS)
    assert max(held_out.values()) - min(held_out.values()) <= 1
    generated = generate_barn_world(14, seed=0)
    assert (generated.fill, generated.smoothing) == parameter_set(14)


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


def test_a_field_open_by_a_diagonal_step_alone_cannot_be_crossed() -> None:
    field = np.zeros((30, 30), dtype=np.bool_)
    field[[0, -1]] = True
    # The robot's configuration space of these two walls meets at one corner.
    field[1:16, 12] = True
    field[20:29, 17] = True
    assert cross_field(field, rng=np.random.default_rng(0)) is None
    field[15, 12] = False
    assert cross_field(field, rng=np.random.default_rng(0)) is not None


def test_the_largest_region_is_crossed_not_the_one_with_the_widest_mouth() -> None:
    field = np.zeros((30, 30), dtype=np.bool_)
    field[[0, -1]] = True
    # A bay with a wide mouth above, a narrower but larger lane below.
    field[20] = True
    field[1:20, 8:] = True
    path = cross_field(field, rng=np.random.default_rng(0))
    assert path is not None
    assert path[:, 0].min() > 20


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
