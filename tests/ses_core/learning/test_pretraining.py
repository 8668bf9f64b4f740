"""Tests of how the original policy comes about."""

import numpy as np
import pytest

from ses_core.arrays import FloatArray
from ses_core.learning.pretraining import (
    WORLD_SEED,
    pretraining,
    training_tasks,
    with_replay,
    world_numbers,
)
from ses_core.robot_profile import JACKAL
from ses_core.settings import TrainingSettings
from ses_core.worlds.cellular_automata import generate_barn_world
from tests.ses_core.learning.places import corridor


def test_250_worlds_are_trained_in_and_50_others_tested_in() -> None:
    training, testing = world_numbers("train"), world_numbers("test")
    assert (len(training), len(testing)) == (250, 50)
    assert sorted([*training, *testing]) == list(range(300))
    assert testing[:3] == [0, 6, 12]


def test_by_default_it_is_the_shipped_policys_training() -> None:
    assert pretraining(TrainingSettings(), steps=None, seed=None) == TrainingSettings(
        steps=100_000, parallel_envs=50
    )


def test_settings_choose_all_but_its_length() -> None:
    settings = TrainingSettings(preset="paper", decision_period_s=0.5, steps=7, seed=3)
    chosen = pretraining(settings, steps=None, seed=None)
    assert chosen == settings.model_copy(update={"steps": 100_000, "parallel_envs": 50})
    asked = pretraining(settings, steps=9, seed=0)
    assert (asked.steps, asked.seed) == (9, 0)


def test_a_world_with_a_course_gives_that_course_and_another_gives_pairs() -> None:
    with_course = generate_barn_world(1, seed=WORLD_SEED).world
    without = corridor("room", length=12.0).world
    tasks = training_tasks([with_course, without], profile=JACKAL, seed=0, pairs=3)
    assert (tasks[0].start, tasks[0].goal) == with_course.course
    assert [task.world.world_id for task in tasks[1:]] == ["room"] * 3


@pytest.mark.parametrize("weights", [None, np.array([3.0, 1.0])])
def test_replayed_tasks_get_their_share_of_the_draws(weights: FloatArray | None) -> None:
    old, new = [corridor()] * 5, [corridor(), corridor()]
    tasks, shares = with_replay(new, weights, old, share=0.2)
    assert tasks == [*new, *old]
    assert shares.sum() == pytest.approx(1.0)
    assert shares[2:] == pytest.approx(0.04)
    assert shares[:2] == pytest.approx([0.4, 0.4] if weights is None else [0.6, 0.2])
