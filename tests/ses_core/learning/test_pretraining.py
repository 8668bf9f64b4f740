"""Tests of how the original policy comes about."""

from ses_core.learning.pretraining import (
    WORLD_SEED,
    training_tasks,
    world_numbers,
)
from ses_core.robot_profile import JACKAL
from ses_core.worlds.cellular_automata import generate_barn_world
from tests.ses_core.learning.places import corridor


def test_250_worlds_are_trained_in_and_50_others_tested_in() -> None:
    training, testing = world_numbers("train"), world_numbers("test")
    assert (len(training), len(testing)) == (250, 50)
    assert sorted([*training, *testing]) == list(range(300))
    assert testing[:3] == [0, 6, 12]


def test_a_world_with_a_course_gives_that_course_and_another_gives_pairs() -> None:
    with_course = generate_barn_world(1, seed=WORLD_SEED).world
    without = corridor("room", length=12.0).world
    tasks = training_tasks([with_course, without], profile=JACKAL, seed=0, pairs=3)
    assert (tasks[0].start, tasks[0].goal) == with_course.course
    assert [task.world.world_id for task in tasks[1:]] == ["room"] * 3
