"""Worlds to measure simulators in: BARN-like places of 5 m, and houses of 30 x 40 m."""

import itertools

import numpy as np

from ses_core.arrays import BoolArray
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import ENVIRONMENT_SIDE_M, OccupancyGrid, environment_course
from ses_core.robot_profile import RobotProfile
from ses_core.worlds.cellular_automata import generate_barn_world
from ses_core.worlds.homes import RESOLUTION_M, WALL_M, generate_home
from ses_core.worlds.pairs import sample_tasks

HOUSE_M = (30.0, 40.0)
"""Depth and length of a house [m]: several homes from our generator, their corridors open."""

_ALLEY_CELLS = 30  # between the homes of a house: 1.5 m


def barn_tasks(count: int, *, seed: int) -> list[NavigationTask]:
    """Give crossings of `count` places of 30 x 30 cells.

    Every generated field comes in four forms, mirrored either way: all can be crossed, and a
    thousand of them are there in seconds.
    """
    tasks: list[NavigationTask] = []
    for index in itertools.count():
        # A field runs along its columns, an environment from its last row to its first.
        cells = generate_barn_world(index, seed=seed).field.T
        for form in (cells, cells[::-1], cells[:, ::-1], cells[::-1, ::-1]):
            if len(tasks) == count:
                return tasks
            grid = environment_course(form)
            world = World(world_id=f"barn-{seed}-{len(tasks)}", grid=grid)
            tasks.append(
                NavigationTask(
                    world=world, start=Pose2D(0.0, 0.0, 0.0), goal=(ENVIRONMENT_SIDE_M, 0.0)
                )
            )
    raise AssertionError("unreachable: the count of forms is endless")


def house_tasks(
    houses: int, per_house: int, *, seed: int, profile: RobotProfile
) -> list[NavigationTask]:
    """Draw start-goal pairs in houses."""
    rng = np.random.default_rng(seed)
    return [
        task
        for index in range(houses)
        for task in sample_tasks(
            _house(seed=1000 * seed + index), per_house, profile=profile, rng=rng
        )
    ]


def _house(*, seed: int) -> World:
    """Set homes in rows on the ground of a house, doors at both ends of every corridor."""
    depth, length = (round(side / RESOLUTION_M) for side in HOUSE_M)
    cells = np.zeros((depth, length), dtype=np.bool_)
    bottom = left = _ALLEY_CELLS
    row_top = 0
    for index in itertools.count():
        home = _open_ends(generate_home(index, seed=seed).grid.cells)
        if left + home.shape[1] > length - _ALLEY_CELLS:
            bottom, left = row_top + _ALLEY_CELLS, _ALLEY_CELLS
        if bottom + home.shape[0] > depth - _ALLEY_CELLS:
            grid = OccupancyGrid(cells=cells, resolution=RESOLUTION_M)
            return World(world_id=f"house-{seed}", grid=grid, source="home")
        cells[bottom : bottom + home.shape[0], left : left + home.shape[1]] = home
        row_top = max(row_top, bottom + home.shape[0])
        left += home.shape[1] + _ALLEY_CELLS
    raise AssertionError("unreachable: homes are endless")


def _open_ends(home: BoolArray) -> BoolArray:
    """Lay a home along its corridor and open the corridor at both ends."""
    wall = round(WALL_M / RESOLUTION_M)
    for cells in (home, home.T):
        is_corridor = ~cells[:, wall:-wall].any(axis=1)
        if is_corridor.any():
            opened = cells.copy()
            opened[is_corridor] = False
            return opened
    raise AssertionError("a home has a corridor without furniture")
