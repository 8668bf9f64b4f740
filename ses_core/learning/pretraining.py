"""The original policy: trained from nothing on worlds of BARN's generator (section IV-A)."""

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from ses_core.learning.training import TrainingResult, train
from ses_core.navigation import NavigationTask, World
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings, TrainingSettings
from ses_core.worlds.cellular_automata import generate_barn_world
from ses_core.worlds.pairs import sample_tasks

Part = Literal["train", "test"]

WORLD_COUNT = 300
"""Worlds of the generator: 250 to train in and 50 to test in, as many as BARN has."""

HELD_OUT_EVERY = 6
"""Worlds 0, 6, 12, ... are never trained in: BARN's own rule."""

WORLD_SEED = 20_211_001
"""Seed of those worlds."""

PRETRAINING = TrainingSettings(steps=100_000, parallel_envs=50)
"""Settings of the shipped original policy."""

PRETRAINING_SIMULATION = SimulationSettings(sensing_rate_hz=2.5)
"""The simulator it was trained in: scans and grids at half the usual rate, for twice the speed.

The policy decides once per second; grids at 1 to 20 Hz were measured to give equal results."""


def world_numbers(part: Part) -> list[int]:
    """Number the worlds that the original policy is trained in, or those it is tested in."""
    return [
        number
        for number in range(WORLD_COUNT)
        if (number % HELD_OUT_EVERY == 0) == (part == "test")
    ]


def generated_worlds(part: Part) -> list[World]:
    """Generate those worlds."""
    return [generate_barn_world(number, seed=WORLD_SEED).world for number in world_numbers(part)]


def training_tasks(
    worlds: Sequence[World], *, profile: RobotProfile, seed: int, pairs: int = 5
) -> list[NavigationTask]:
    """Give a world's own course, or start-goal pairs drawn in it where it has none."""
    rng = np.random.default_rng(seed)
    return [
        task for world in worlds for task in sample_tasks(world, pairs, profile=profile, rng=rng)
    ]


def pretrain(
    worlds: Sequence[World] | None = None,
    *,
    settings: TrainingSettings = PRETRAINING,
    simulation: SimulationSettings = PRETRAINING_SIMULATION,
    profile: RobotProfile,
    progress: Callable[[float], None] = lambda _: None,
    deadline: Callable[[], bool] = lambda: False,
) -> TrainingResult:
    """Train a policy from random weights.

    Args:
        worlds: Where it is trained; by default the 250 generated training worlds.
        settings: Algorithm, decisions, seed.
        simulation: Rates and imperfections of the robot.
        profile: The robot.
        progress: Hears the share that is done, from 0 to 1.
        deadline: Asked after every second of driving; the training ends when it says yes.

    Raises:
        ValueError: There is no world, or no world has room for a task.
    """
    chosen = generated_worlds("train") if worlds is None else worlds
    return train(
        training_tasks(chosen, profile=profile, seed=settings.seed),
        parent=None,
        settings=settings,
        simulation=simulation,
        profile=profile,
        progress=progress,
        deadline=deadline,
    )
