"""Tests of how the original policy comes about."""

from ses_core.learning.pretraining import (
    WORLD_SEED,
    pretrain,
    training_tasks,
    world_numbers,
)
from ses_core.navigation import World
from ses_core.robot_profile import JACKAL
from ses_core.settings import TrainingSettings
from ses_core.worlds.cellular_automata import generate_barn_world
from tests.ses_core.learning.places import corridor


def some_worlds() -> list[World]:
    return [generate_barn_world(number, seed=WORLD_SEED).world for number in (1, 2)]


def test_250_worlds_are_trained_in_and_50_others_tested_in() -> None:
    training, testing = world_numbers("train"), world_numbers("test")
    assert (len(training), len(testing)) == (250, 50)
    assert sorted([*training, *testing]) == list(range(300))
    assert testing[:3] == [0, 6, 12]


def test_a_world_with_a_course_gives_that_course_and_another_gives_pairs() -> None:
    with_course = some_worlds()[0]
    without = corridor("room", length=12.0).world
    tasks = training_tasks([with_course, without], profile=JACKAL, seed=0, pairs=3)
    assert (tasks[0].start, tasks[0].goal) == with_course.course
    assert [task.world.world_id for task in tasks[1:]] == ["room"] * 3


def test_pretraining_starts_from_nothing_and_trains() -> None:
    result = pretrain(
        some_worlds(),
        settings=TrainingSettings(steps=64, parallel_envs=4),
        profile=JACKAL,
    )
    assert (result.steps, result.reason) == (64, "finished")
    assert result.policy.observation.name == "default"
