"""Tests of the learners' actors against the policies they start as."""

from typing import Literal

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3 import SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import DummyVecEnv

from ses_core.arrays import Float32Array
from ses_core.learning.action import SEVEN
from ses_core.learning.algorithms import (
    actor_parameters,
    extract_policy,
    make_learner,
)
from ses_core.learning.critics import extract_critic, set_critic
from ses_core.learning.navigation_env import action_space, observation_space
from ses_core.learning.observation import DEFAULT_OBSERVATION
from ses_core.learning.policies import ParameterPolicy, random_policy
from ses_core.settings import TrainingSettings

Algorithm = Literal["ppo", "td3", "sac"]
ALGORITHMS: tuple[Algorithm, ...] = ("ppo", "td3", "sac")


class Still(gymnasium.Env[Float32Array, Float32Array]):
    """Episodes of one decision, all alike."""

    observation_space = observation_space(DEFAULT_OBSERVATION, SEVEN)
    action_space = action_space(SEVEN)

    def reset(
        self, *, seed: int | None = None, options: dict[str, object] | None = None
    ) -> tuple[Float32Array, dict[str, object]]:
        return np.full(DEFAULT_OBSERVATION.length(SEVEN), 0.25, dtype=np.float32), {}

    def step(
        self, action: Float32Array
    ) -> tuple[Float32Array, float, bool, bool, dict[str, object]]:
        return (
            np.full(DEFAULT_OBSERVATION.length(SEVEN), 0.25, dtype=np.float32),
            1.0,
            True,
            False,
            {},
        )


class Wanting(Still):
    """Episodes of one decision, rewarded by the first action alone."""

    def step(
        self, action: Float32Array
    ) -> tuple[Float32Array, float, bool, bool, dict[str, object]]:
        observation, _, terminated, truncated, info = super().step(action)
        return observation, float(action[0]), terminated, truncated, info


def some_policy() -> ParameterPolicy:
    policy = random_policy(DEFAULT_OBSERVATION, (24, 12), rng=np.random.default_rng(0))
    return ParameterPolicy(
        observation=policy.observation,
        weights=(*policy.weights[:-1], policy.weights[-1] * 50),
        biases=policy.biases,
    )


def still_env(count: int = 2) -> DummyVecEnv:
    return DummyVecEnv([Still for _ in range(count)])


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_learner_starts_as_the_policy_it_goes_on_from(algorithm: Algorithm) -> None:
    settings = TrainingSettings(algorithm=algorithm, steps=64)
    start = some_policy()
    learner, _ = make_learner(still_env(), start, settings=settings, is_fine_tuning=True)
    seen = np.random.default_rng(1).uniform(-0.5, 0.5, (30, 129)).astype(np.float32)
    predicted, _ = learner.predict(seen, deterministic=True)
    np.testing.assert_allclose(predicted, start.actions(seen.astype(np.float64)), atol=1e-5)
    copied = extract_policy(learner, start)
    for matrix, copy in zip(start.weights, copied.weights, strict=True):
        np.testing.assert_array_equal(matrix, copy)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_exploration_differs_between_the_robots_of_a_batch(algorithm: Algorithm) -> None:
    settings = TrainingSettings(algorithm=algorithm, steps=64)
    taken: list[Float32Array] = []

    class Recorder(DummyVecEnv):
        def step_async(self, actions: Float32Array) -> None:
            taken.append(actions.copy())
            super().step_async(actions)

    env = Recorder([Still for _ in range(3)])
    learner, decisions = make_learner(env, some_policy(), settings=settings, is_fine_tuning=True)
    learner.learn(decisions)
    assert len(np.unique(taken[0].round(6), axis=0)) == 3


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_frozen_actor_stays_while_its_critic_learns(algorithm: Algorithm) -> None:
    settings = TrainingSettings(algorithm=algorithm, steps=64)
    start = some_policy()
    learner, decisions = make_learner(still_env(), start, settings=settings, is_fine_tuning=True)
    for parameter in actor_parameters(learner):
        parameter.requires_grad_(False)
    frozen = {id(parameter) for parameter in actor_parameters(learner)}
    others = [one for one in learner.policy.parameters() if id(one) not in frozen]
    before = [one.detach().clone() for one in others]
    learner.learn(decisions)
    kept = extract_policy(learner, start)
    for old, new in zip(start.weights, kept.weights, strict=True):
        np.testing.assert_array_equal(old, new)
    assert any(not torch.equal(old, new) for old, new in zip(before, others, strict=True))


@pytest.mark.parametrize("steps", [64, 100, 1000, 3300])
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_whole_rollouts_come_close_to_the_decisions_asked_for(
    algorithm: Algorithm, steps: int
) -> None:
    settings = TrainingSettings(algorithm=algorithm, steps=steps)
    _, decisions = make_learner(still_env(4), some_policy(), settings=settings, is_fine_tuning=True)
    assert 0.9 * steps <= decisions <= steps


@pytest.mark.parametrize(
    ("preset", "rate", "updates", "steps_of_return"),
    [("default", 1e-4, 5, 1), ("authors", 1e-5, 20, 4), ("paper", 2e-4, 2, 4)],
)
def test_presets_have_their_constants(
    preset: Literal["default", "authors", "paper"], rate: float, updates: int, steps_of_return: int
) -> None:
    settings = TrainingSettings(algorithm="td3", preset=preset, gamma=0.95, steps=1000)
    learner, _ = make_learner(still_env(20), some_policy(), settings=settings, is_fine_tuning=False)
    assert isinstance(learner, TD3)
    assert learner.lr_schedule(1.0) == rate
    assert learner.gradient_steps == updates
    assert learner.n_steps == steps_of_return


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_learner_learns_what_is_rewarded(algorithm: Algorithm) -> None:
    settings = TrainingSettings(algorithm=algorithm, steps=3000, learning_rate=1e-3, gamma=0.5)
    start = random_policy(DEFAULT_OBSERVATION, (24, 12), rng=np.random.default_rng(0))
    env = DummyVecEnv([Wanting for _ in range(50)])
    learner, decisions = make_learner(env, start, settings=settings, is_fine_tuning=False)
    learner.learn(decisions)
    seen = np.full((1, DEFAULT_OBSERVATION.length(SEVEN)), 0.25)
    assert abs(start.actions(seen)[0, 0]) < 0.2
    learned = extract_policy(learner, start).actions(seen)[0, 0]
    assert learned > 0.4


def learner_of(algorithm: Algorithm, *, seed: int) -> BaseAlgorithm:
    settings = TrainingSettings(algorithm=algorithm, steps=64, seed=seed)
    return make_learner(still_env(), some_policy(), settings=settings, is_fine_tuning=True)[0]


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_critic_goes_from_learner_to_learner(algorithm: Algorithm) -> None:
    first, second = learner_of(algorithm, seed=0), learner_of(algorithm, seed=1)
    critic = extract_critic(first)
    assert any((critic[name] != other).any() for name, other in extract_critic(second).items())
    set_critic(second, critic)
    for name, tensor in extract_critic(second).items():
        np.testing.assert_array_equal(tensor, critic[name])
    if isinstance(second, TD3 | SAC):
        for own, target in zip(
            second.critic.parameters(), second.critic_target.parameters(), strict=True
        ):
            assert torch.equal(own, target)


def test_another_learners_critic_is_refused() -> None:
    with pytest.raises(ValueError, match="another algorithm's"):
        set_critic(learner_of("ppo", seed=0), extract_critic(learner_of("td3", seed=0)))
