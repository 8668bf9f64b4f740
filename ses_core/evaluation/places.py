"""Where policies are measured: the start-goal pairs of held-out worlds and environments."""

from collections.abc import Sequence

import numpy as np

from ses_core.evaluation.trials import EvaluationTask, evaluation_task
from ses_core.navigation import NavigationDomain, World, environment_task
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
    places = []
    for world in worlds:
        seed = [settings.seed, int(content_digest(world.grid)[:8], 16)]
        tasks = sample_tasks(
            world,
            settings.pairs,
            profile=profile,
            min_distance=settings.min_distance_m,
            rng=np.random.default_rng(seed),
        )
        places += [
            evaluation_task(one, pair=pair, profile=profile) for pair, one in enumerate(tasks)
        ]
    return places
