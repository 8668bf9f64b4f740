"""Where policies are measured: the start-goal pairs of held-out worlds and environments."""

from collections.abc import Sequence

import numpy as np

from ses_core.evaluation.trials import EvaluationTask, evaluation_task
from ses_core.navigation import NavigationDomain, NavigationTask, World, environment_task
from ses_core.robot_profile import RobotProfile
from ses_core.settings import EvaluationSettings
from ses_core.worlds.identity import content_digest
from ses_core.worlds.pairs import sample_tasks


def crossing_places(domain: NavigationDomain, profile: RobotProfile) -> list[EvaluationTask]:
    """Make one pair of each environment: across it, from the bottom to the top."""
    return [
        evaluation_task(environment_task(environment), pair=0, profile=profile)
        for environment in domain.environments
    ]


def sampled_places(
    worlds: Sequence[World], *, settings: EvaluationSettings, profile: RobotProfile
) -> list[EvaluationTask]:
    """Draw start-goal pairs in worlds; one too small for any pair gives none.

    The pairs of a world depend on its cells and the seed alone, not on the worlds beside it;
    more pairs begin with the same ones.
    """
    return [
        evaluation_task(task, pair=pair, profile=profile)
        for world in worlds
        for pair, task in enumerate(pairs_of(world, settings=settings, profile=profile))
    ]


def pairs_of(
    world: World, *, settings: EvaluationSettings, profile: RobotProfile
) -> list[NavigationTask]:
    """Draw the start-goal pairs of one world."""
    return sample_tasks(
        world,
        settings.pairs,
        profile=profile,
        min_distance=settings.min_distance_m,
        preset=settings.pair_preset,
        rng=np.random.default_rng([settings.seed, int(content_digest(world.grid)[:8], 16)]),
    )
