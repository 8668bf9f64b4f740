"""Tests of the Gymnasium environment in the real simulator."""

import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import gymnasium.utils.env_checker as gymnasium_checker
import numpy as np
import pytest
import stable_baselines3.common.env_checker as learner_checker

from ses_core.geometry import Pose2D
from ses_core.learning.navigation_env import NavigationEnv
from ses_core.navigation import NavigationTask
from ses_core.robot_profile import JACKAL, TURTLEBOT4, RobotProfile
from ses_core.settings import SimulationSettings, TrainingSettings
from ses_core.simulation.factory import make_simulator
from tests.ses_core.learning.places import closed_room, corridor

FASTEST = np.ones(7, dtype=np.float32)


Preset = Literal["default", "authors", "paper"]


def make_env(
    *tasks: NavigationTask,
    slots: int = 1,
    profile: RobotProfile = JACKAL,
    settings: TrainingSettings | None = None,
) -> NavigationEnv:
    simulation = SimulationSettings(stuck_time_s=6.0)
    simulator = make_simulator("batch", slots=slots, profile=profile, settings=simulation)
    return NavigationEnv(simulator, tasks=tasks or [corridor()], profile=profile, settings=settings)


@pytest.mark.parametrize(
    "check", [gymnasium_checker.check_env, learner_checker.check_env], ids=["gymnasium", "sb3"]
)
@pytest.mark.parametrize(
    ("preset", "profile"),
    [("default", JACKAL), ("authors", JACKAL), ("paper", JACKAL), ("default", TURTLEBOT4)],
    ids=["default", "authors", "paper", "turtlebot4"],
)
def test_the_env_passes_the_checkers(
    check: Callable[..., None], preset: Preset, profile: RobotProfile
) -> None:
    env = make_env(profile=profile, settings=TrainingSettings(preset=preset))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # An env made without a registry has no spec to make a second one from.
        warnings.filterwarnings("ignore", message=".*Not able to test alternative render modes.*")
        warnings.filterwarnings("ignore", message=".*env.spec.*")
        check(env, skip_render_check=True)


@pytest.mark.parametrize(("preset", "length"), [("default", 129), ("authors", 721), ("paper", 728)])
def test_one_name_chooses_what_is_seen_and_what_is_rewarded(preset: Preset, length: int) -> None:
    env = make_env(settings=TrainingSettings(preset=preset))
    assert env.observation_space.shape == (length,)
    first, _ = env.reset(seed=0)
    assert first.shape == (length,)
    total, terminated = 0.0, False
    while not terminated:
        _, reward, terminated, _, info = env.step(0.0 * FASTEST)
        total += reward
    assert info["outcome"] == "success"
    # 3 m made and a little more; the paper's way counts half, less 1 % of it per decision.
    success, least, most = {
        "default": (20.0, 3.0, 3.6),
        "authors": (20.0, 2.9, 3.6),
        "paper": (10.0, 1.3, 1.8),
    }[preset]
    assert success + least <= total <= success + most


def test_decisions_are_as_far_apart_as_the_settings_say() -> None:
    times = {}
    for period in (None, 0.5, 2.0):
        env = make_env(settings=TrainingSettings(decision_period_s=period))
        env.reset(seed=0)
        times[period] = [env.step(-FASTEST)[4]["time"] for _ in range(3)]
    assert times[None] == pytest.approx([1.0, 2.0, 3.0])
    assert times[0.5] == pytest.approx([0.5, 1.0, 1.5])
    assert times[2.0] == pytest.approx([2.0, 4.0, 6.0])


def test_progress_and_success_are_rewarded() -> None:
    env = make_env()
    _, info = env.reset(seed=0)
    assert info == {}
    total, terminated, decisions = 0.0, False, 0
    while not terminated:
        observation, reward, terminated, truncated, info = env.step(0.0 * FASTEST)
        total += reward
        decisions += 1
        assert not truncated
        assert observation.dtype == np.float32
    assert info["outcome"] == "success"
    # 4 m away at first, less than 1 m at last, and 20 for getting there.
    assert 23.0 <= total <= 23.6
    assert decisions == pytest.approx(info["time"], abs=1.0)


def test_a_failure_costs_the_penalty() -> None:
    env = make_env(closed_room())
    env.reset(seed=0)
    terminated, reward = False, 0.0
    while not terminated:
        _, reward, terminated, _, info = env.step(0.0 * FASTEST)
    assert info["outcome"] in {"stuck", "collision"}
    assert reward < -17.0


def test_nearness_costs_where_the_settings_give_it_a_weight() -> None:
    beside_the_wall = replace(corridor(), start=Pose2D(1.0, 0.39, 0.0))
    earned = {}
    for weight in (0.0, 0.1):
        env = make_env(beside_the_wall, settings=TrainingSettings(collision_weight=weight))
        env.reset(seed=0)
        earned[weight] = env.step(-FASTEST)[1]
    # The wall is 0.24 m away at first, and not much farther a second later.
    assert 0.1 / 0.35 < earned[0.0] - earned[0.1] < 0.1 / 0.25


def test_actions_act() -> None:
    env = make_env()
    travelled = []
    for action in (-FASTEST, FASTEST):
        env.reset(seed=1)
        travelled.append(env.step(action)[1])
    assert travelled[1] > 2.0 * travelled[0]


def test_more_than_one_slot_is_refused() -> None:
    with pytest.raises(ValueError, match="has 2 slots, expected 1"):
        make_env(slots=2)


def test_no_task_is_refused() -> None:
    simulator = make_simulator("batch", slots=1, profile=JACKAL, settings=SimulationSettings())
    with pytest.raises(ValueError, match="found no task"):
        NavigationEnv(simulator, tasks=[])
