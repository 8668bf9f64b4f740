"""Start-goal pairs that trials are driven between."""

import math

import numpy as np

from ses_core.evaluation.places import crossing_places, pairs_of, sampled_places
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from ses_core.robot_profile import JACKAL
from ses_core.settings import EvaluationSettings
from ses_core.worlds.homes import generate_homes


def settings(pairs: int, seed: int = 0) -> EvaluationSettings:
    return EvaluationSettings(pairs=pairs, seed=seed, min_distance_m=5.0)


def test_more_pairs_of_a_world_begin_with_the_same_ones() -> None:
    worlds = generate_homes(2, seed=0)
    few = sampled_places(worlds[1:], settings=settings(2), profile=JACKAL)
    many = sampled_places(worlds, settings=settings(4), profile=JACKAL)

    assert [(place.world_id, place.pair) for place in many] == [
        (world.world_id, pair) for world in worlds for pair in range(4)
    ]
    assert few == many[4:6]
    assert few != sampled_places(worlds[1:], settings=settings(2, seed=1), profile=JACKAL)


def test_the_preset_of_pairs_is_a_setting() -> None:
    worlds = generate_homes(1, seed=0)
    long = settings(4).model_copy(update={"pair_preset": "long"})

    def lengths(chosen: EvaluationSettings) -> list[float]:
        tasks = pairs_of(worlds[0], settings=chosen, profile=JACKAL)
        return [math.dist((task.start.x, task.start.y), task.goal) for task in tasks]

    assert min(lengths(long)) > min(lengths(settings(4)))
    assert min(lengths(long)) > 0.85 * max(lengths(long))


def test_an_environment_is_crossed_once_from_bottom_to_top() -> None:
    empty = NavigationEnvironment(
        environment_id="empty",
        cells=np.zeros((30, 30), dtype=np.bool_),
        observed=np.ones((30, 30), dtype=np.bool_),
        origin="gan",
    )
    (place,) = crossing_places(NavigationDomain((empty,)), JACKAL)

    assert (place.world_id, place.pair) == ("empty", 0)
    assert place.task.goal == (5.0, 0.0)
    assert 2.4 < place.optimal_time_s < 2.7
