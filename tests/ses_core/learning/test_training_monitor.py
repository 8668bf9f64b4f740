"""Tests of the watch over a training, with episodes that go as a script says."""

import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.vec_env import DummyVecEnv

from ses_core.arrays import Float32Array
from ses_core.learning.action import SEVEN
from ses_core.learning.algorithms import make_learner
from ses_core.learning.navigation_env import action_space, observation_space
from ses_core.learning.observation import DEFAULT_OBSERVATION
from ses_core.learning.policies import random_policy
from ses_core.learning.training_monitor import TrainingMonitor
from ses_core.settings import TrainingSettings

STEPS, ROBOTS = 8192, 32


class Scripted(gymnasium.Env[Float32Array, Float32Array]):
    """Episodes of one decision; they succeed until decision `turn`, and from there get stuck."""

    observation_space = observation_space(DEFAULT_OBSERVATION, SEVEN)
    action_space = action_space(SEVEN)

    def __init__(self, turn: int) -> None:
        self._turn, self._made = turn, 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, object] | None = None
    ) -> tuple[Float32Array, dict[str, object]]:
        return np.zeros(DEFAULT_OBSERVATION.length(SEVEN), dtype=np.float32), {}

    def step(
        self, action: Float32Array
    ) -> tuple[Float32Array, float, bool, bool, dict[str, object]]:
        self._made += 1
        outcome = "success" if self._made <= self._turn else "stuck"
        info: dict[str, object] = {"outcome": outcome, "episode": {"r": 1.0, "l": 1, "t": 9.0}}
        return np.zeros(DEFAULT_OBSERVATION.length(SEVEN), dtype=np.float32), 0.0, True, False, info


def watch(turn: int, *, stop_after: int | None = None) -> tuple[TrainingMonitor, list[float], int]:
    env = DummyVecEnv([lambda: Scripted(turn // ROBOTS) for _ in range(ROBOTS)])
    asked = 0

    def deadline() -> bool:
        nonlocal asked
        asked += 1
        return stop_after is not None and asked > stop_after

    start = random_policy(DEFAULT_OBSERVATION, (4,), rng=np.random.default_rng(0))
    learner, decisions = make_learner(
        env, start, settings=TrainingSettings(steps=STEPS), is_fine_tuning=True
    )
    shares: list[float] = []
    monitor = TrainingMonitor(
        start=start,
        decisions=decisions,
        checkpoint_decisions=10_000,
        frozen_decisions=0,
        progress=shares.append,
        deadline=deadline,
    )
    learner.learn(decisions, callback=monitor)
    return monitor, shares, learner.num_timesteps


def test_a_training_that_goes_well_runs_to_its_end() -> None:
    monitor, shares, steps = watch(STEPS)
    assert monitor.reason == "finished"
    assert steps == STEPS
    assert 40 <= len(monitor.curve) <= 50
    assert sum(point.episodes for point in monitor.curve) == STEPS
    assert {point.success_rate for point in monitor.curve} == {1.0}
    assert {point.mean_time_s for point in monitor.curve} == {9.0}
    assert shares == sorted(shares)
    assert shares[-1] > 0.95


def test_a_collapse_ends_the_training_after_two_bad_stretches() -> None:
    monitor, _, steps = watch(4096)
    assert monitor.reason == "diverged"
    assert monitor.best is not None
    assert steps == pytest.approx(4096 + 2 * STEPS / 50, abs=6 * ROBOTS)
    assert monitor.curve[-1].success_rate == 0.0
    assert monitor.curve[-1].mean_time_s is None


def test_a_passed_deadline_ends_the_training_at_once() -> None:
    monitor, _, steps = watch(STEPS, stop_after=20)
    assert monitor.reason == "deadline"
    assert steps == 21 * ROBOTS
