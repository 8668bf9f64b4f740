import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import JACKAL
from ses_core.worlds.cellular_automata import COURSE_GOAL, COURSE_START, generate_barn_world
from ses_core.worlds.identity import named_world
from ses_core.worlds.pairs import farthest_apart, sample_tasks, standing_places


def _two_rooms(*, door_cells: int) -> World:
    """Two rooms of 6 x 6 m at 0.05 m, with a door in the wall between them."""
    cells = np.zeros((120, 242), dtype=np.bool_)
    cells[:, 120:122] = True
    cells[40 : 40 + door_cells, 120:122] = False
    return named_world("rooms", OccupancyGrid(cells=cells, resolution=0.05), source="test")


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_every_pair_keeps_the_rule(seed: int) -> None:
    world = _two_rooms(door_cells=24)
    tasks = sample_tasks(world, 5, profile=JACKAL, rng=np.random.default_rng(seed))
    assert len(tasks) == 5
    for task in tasks:
        dx, dy = task.goal[0] - task.start.x, task.goal[1] - task.start.y
        assert math.hypot(dx, dy) >= 6.6
        assert task.start.yaw == math.atan2(dy, dx)
        for x, y in ((task.start.x, task.start.y), task.goal):
            walls = np.argwhere(np.pad(world.grid.cells, 1, constant_values=True)) - 1
            corners = walls[:, ::-1] * 0.05
            nearest = np.clip((x, y), corners, corners + 0.05)
            clearance = np.hypot(*(nearest - (x, y)).T).min()
            assert clearance >= JACKAL.circumscribed_radius_m


def test_a_door_hardly_wider_than_the_robot_separates_two_rooms() -> None:
    for door_cells, crosses in ((10, False), (14, False), (24, True)):
        world = _two_rooms(door_cells=door_cells)
        tasks = sample_tasks(world, 60, profile=JACKAL, rng=np.random.default_rng(3))
        assert len(tasks) == 60
        sides = {(task.start.x < 6.0, task.goal[0] < 6.0) for task in tasks}
        assert ((True, False) in sides or (False, True) in sides) == crosses


def test_same_seed_same_pairs() -> None:
    world = _two_rooms(door_cells=24)
    first, second = (
        sample_tasks(world, 4, profile=JACKAL, rng=np.random.default_rng(9)) for _ in range(2)
    )
    assert first == second


def test_a_world_without_two_places_far_enough_apart_has_no_pair() -> None:
    small = named_world(
        "small", OccupancyGrid(cells=np.zeros((60, 60), np.bool_), resolution=0.05), source="test"
    )
    full = named_world(
        "full", OccupancyGrid(cells=np.ones((60, 60), np.bool_), resolution=0.05), source="test"
    )
    for world in (small, full):
        assert sample_tasks(world, 3, profile=JACKAL, rng=np.random.default_rng(0)) == []
    assert len(standing_places(full.grid, JACKAL).points) == 0


def test_long_pairs_are_nearly_as_far_apart_as_any() -> None:
    world = _two_rooms(door_cells=24)
    places = standing_places(world.grid, JACKAL)
    farthest = max(
        float(np.linalg.norm(region - place, axis=1).max())
        for number in np.unique(places.regions)
        for region in [places.points[places.regions == number]]
        for place in region
    )
    assert farthest_apart(places) == pytest.approx(farthest, rel=1e-3)
    tasks = sample_tasks(world, 20, profile=JACKAL, rng=np.random.default_rng(2), preset="long")
    distances = [
        math.hypot(task.goal[0] - task.start.x, task.goal[1] - task.start.y) for task in tasks
    ]
    assert min(distances) >= max(6.6, 0.89 * farthest)
    assert len(distances) == 20


def test_a_wall_between_two_rooms_shortens_long_pairs() -> None:
    apart, joined = (
        farthest_apart(standing_places(_two_rooms(door_cells=cells).grid, JACKAL))
        for cells in (0, 24)
    )
    assert apart < 0.7 * joined


def test_a_world_with_a_course_has_that_one_pair() -> None:
    world = generate_barn_world(0, seed=0).world
    tasks = sample_tasks(world, 7, profile=JACKAL, rng=np.random.default_rng(0))
    assert [(task.start, task.goal) for task in tasks] == [(COURSE_START, COURSE_GOAL)]
