"""Worlds to measure simulators in: BARN-like places of 5 m, and houses of 30 x 40 m."""

import itertools

import numpy as np

from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import ENVIRONMENT_SIDE_M, environment_course
from ses_core.robot_profile import RobotProfile
from ses_core.worlds.cellular_automata import generate_barn_world
from ses_core.worlds.homes import generate_home
from ses_core.worlds.pairs import sample_tasks

HOUSE_M = (30.0, 40.0)
"""Ground a house is built on [m]: height and length."""


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
            generate_home(index, seed=seed, sides_m=HOUSE_M), per_house, profile=profile, rng=rng
        )
    ]
