"""What the original policy is trained in, and how: worlds of BARN's generator (section IV-A)."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from ses_core.arrays import FloatArray
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

STEPS, PARALLEL_ENVS = 100_000, 50
"""How long, and in how many worlds at once, the shipped original policy was trained."""

PRETRAINING_SIMULATION = SimulationSettings(sensing_rate_hz=2.5)
"""The simulator it was trained in: scans and grids at half the usual rate, for twice the speed.

The policy decides once per second; grids at 1 to 20 Hz were measured to give equal results."""


def pretraining(
    training: TrainingSettings, *, steps: int | None, seed: int | None
) -> TrainingSettings:
    """Give a pretraining its settings: of the length of the shipped policy's, unless asked.

    Algorithm, reward, what is seen and how often is decided are the settings' own.
    """
    changes = {
        "steps": STEPS if steps is None else steps,
        "parallel_envs": PARALLEL_ENVS,
        "seed": training.seed if seed is None else seed,
    }
    return training.model_copy(update=changes)


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


def with_replay(
    tasks: Sequence[NavigationTask],
    weights: FloatArray | None,
    replayed: Sequence[NavigationTask],
    *,
    share: float,
) -> tuple[list[NavigationTask], FloatArray]:
    """Mix tasks of an earlier training into a new one's, against forgetting.

    Args:
        tasks: The new training's.
        weights: How often each of these is drawn (N,), in any scale; equally often without.
        replayed: The earlier training's, drawn equally often.
        share: Of the draws that go to the earlier training's.

    Returns:
        All tasks, and how often each is drawn, with sum 1.
    """
    own = np.ones(len(tasks)) if weights is None else weights
    old = np.full(len(replayed), share / len(replayed))
    return [*tasks, *replayed], np.concatenate([(1.0 - share) * own / own.sum(), old])
