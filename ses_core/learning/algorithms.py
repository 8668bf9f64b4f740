"""PPO, TD3 and SAC behind one shape of actor (leaf: stable-baselines3, torch).

Every learner's actor is the perceptron of `ParameterPolicy`: rectified layers and a hyperbolic
tangent, so that any of them can go on from what any other has trained.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecEnv
from torch import nn

from ses_core.arrays import Float32Array
from ses_core.learning.policies import ParameterPolicy
from ses_core.settings import TrainingSettings

_ROLLOUT = 1024
"""Decisions of all robots together between two updates of PPO."""

_MINIBATCHES, _EPOCHS = 8, 10
"""Of PPO per rollout: many, for a decision costs more to simulate than to learn from."""

_LEAST_BATCH = 64

_EXPLORATION = {"scratch": 0.6, "fine-tuning": 0.3}
"""Standard deviation of PPO's and SAC's first actions, in units of the action."""

_NOISE = (0.2, 0.05)
"""TD3's exploration, from first to last decision (ros_jackal's `configs/laser.yaml`)."""

_BUFFER = 200_000
"""Transitions kept by TD3 and SAC (ros_jackal's `configs/laser.yaml`)."""


@dataclass(frozen=True, slots=True)
class _OffPolicyPreset:
    """Constants of TD3 and SAC that differ from preset to preset.

    Attributes:
        rate: Learning rate; None leaves it to the algorithm.
        updates: Updates per decision.
        steps_of_return: Decisions whose rewards are summed before the critic is asked.
    """

    rate: float | None
    updates: float
    steps_of_return: int


_OFF_POLICY = {
    "default": _OffPolicyPreset(rate=None, updates=0.25, steps_of_return=1),
    "authors": _OffPolicyPreset(rate=1e-5, updates=1.0, steps_of_return=4),
    "paper": _OffPolicyPreset(rate=2e-4, updates=0.1, steps_of_return=4),
}
"""Ours; ros_jackal's `configs/laser.yaml`; the actor's rate of APPLR's `td3_condor.json`.

A quarter of the authors' updates costs a quarter of the time and teaches nearly as much."""


class _SquashedMeanPolicy(ActorCriticPolicy):
    """PPO's policy with a hyperbolic tangent on the mean, as TD3's actor has it."""

    def _build(self, lr_schedule: Callable[[float], float]) -> None:
        super()._build(lr_schedule)
        self.action_net = nn.Sequential(self.action_net, nn.Tanh())


class _FadingNoise(NormalActionNoise):
    """Exploration whose standard deviation falls from one value to another."""

    def __init__(
        self, first: float, last: float, *, length: int, progress: Callable[[], float]
    ) -> None:
        super().__init__(mean=np.zeros(length), sigma=np.full(length, first))
        self._first, self._last, self._progress = first, last, progress

    def __call__(self) -> NDArray[Any]:
        share = min(1.0, self._progress())
        self._sigma[:] = self._first + share * (self._last - self._first)
        return super().__call__()


def make_learner(
    env: VecEnv, start: ParameterPolicy, *, settings: TrainingSettings, is_fine_tuning: bool
) -> tuple[BaseAlgorithm, int]:
    """Make a learner whose actor starts as a policy.

    Args:
        env: What it learns in.
        start: The policy it starts from; sizes and observation are taken from it.
        settings: Algorithm, constants and decisions.
        is_fine_tuning: Explore less, for the start is already good.

    Returns:
        The learner, and the decisions it can make in whole rollouts.
    """
    make = {"ppo": _make_ppo, "td3": _make_td3, "sac": _make_sac}[settings.algorithm]
    deviation = _EXPLORATION["fine-tuning" if is_fine_tuning else "scratch"]
    learner, decisions = make(env, list(start.hidden_sizes), settings, math.log(deviation))
    with torch.no_grad():
        for layer, matrix, bias in zip(
            actor_layers(learner), start.weights, start.biases, strict=True
        ):
            layer.weight.copy_(torch.from_numpy(matrix))
            layer.bias.copy_(torch.from_numpy(bias))
        if isinstance(learner, TD3):
            learner.actor_target.load_state_dict(learner.actor.state_dict())
        if isinstance(learner, SAC):
            _deviation_layer(learner).weight.zero_()
            _deviation_layer(learner).bias.fill_(math.log(deviation))
    return learner, decisions


def actor_layers(learner: BaseAlgorithm) -> list[nn.Linear]:
    """Give the linear layers from the observation to the mean action."""
    if isinstance(learner, PPO):
        parts = [learner.policy.mlp_extractor.policy_net, learner.policy.action_net]
    elif isinstance(learner, SAC):
        parts = [learner.actor.latent_pi, learner.actor.mu]
    elif isinstance(learner, TD3):
        parts = [learner.actor.mu]
    else:
        raise ValueError(
            f"found a learner of type {type(learner).__name__}, expected PPO, TD3, SAC"
        )
    return [layer for part in parts for layer in part.modules() if isinstance(layer, nn.Linear)]


def actor_parameters(learner: BaseAlgorithm) -> list[nn.Parameter]:
    """Give all that is frozen while a new critic is trained alone."""
    own = [parameter for layer in actor_layers(learner) for parameter in layer.parameters()]
    if isinstance(learner, PPO):
        return [*own, learner.policy.log_std]
    if isinstance(learner, SAC):
        return [*own, *_deviation_layer(learner).parameters()]
    return own


def extract_policy(learner: BaseAlgorithm, start: ParameterPolicy) -> ParameterPolicy:
    """Copy a learner's actor into a policy that needs no torch, like its start in all else."""
    layers = actor_layers(learner)

    def copied(tensor: torch.Tensor) -> Float32Array:
        return tensor.detach().cpu().numpy().astype(np.float32, copy=True)

    return replace(
        start,
        weights=tuple(copied(layer.weight) for layer in layers),
        biases=tuple(copied(layer.bias) for layer in layers),
    )


def _deviation_layer(learner: SAC) -> nn.Linear:
    return cast("nn.Linear", learner.actor.log_std)


def _make_ppo(
    env: VecEnv, hidden: list[int], settings: TrainingSettings, log_deviation: float
) -> tuple[PPO, int]:
    """Make PPO, whose rollouts are cut so that they make up the decisions asked for."""
    rollouts = max(1, settings.steps // max(_ROLLOUT, 8 * env.num_envs))
    length = max(2, settings.steps // (env.num_envs * rollouts))
    transitions = length * env.num_envs
    most = max(1, min(_MINIBATCHES, transitions // _LEAST_BATCH))
    minibatches = next(count for count in range(most, 0, -1) if transitions % count == 0)
    first_rate = settings.learning_rate or 3e-4
    learner = PPO(
        _SquashedMeanPolicy,
        env,
        learning_rate=lambda remaining: first_rate * (0.1 + 0.9 * remaining),
        n_steps=length,
        batch_size=transitions // minibatches,
        n_epochs=_EPOCHS,
        gamma=settings.gamma,
        target_kl=0.1,
        policy_kwargs={
            "net_arch": {"pi": hidden, "vf": hidden},
            "activation_fn": nn.ReLU,
            "log_std_init": log_deviation,
        },
        seed=settings.seed,
        device="cpu",
    )
    return learner, rollouts * transitions


def _make_td3(
    env: VecEnv, hidden: list[int], settings: TrainingSettings, _: float
) -> tuple[TD3, int]:
    """Make TD3 in its one-rate form, for stable-baselines3 has no second learning rate."""
    rounds = max(1, settings.steps // env.num_envs)
    learner = TD3(
        "MlpPolicy",
        env,
        **_off_policy(env, hidden, settings, rounds=rounds, rate=1e-4),
        policy_delay=2,
    )
    decisions = rounds * env.num_envs
    learner.action_noise = _FadingNoise(
        *_NOISE,
        length=_action_length(env),
        progress=lambda: learner.num_timesteps / decisions,
    )
    return learner, decisions


def _action_length(env: VecEnv) -> int:
    shape = env.action_space.shape
    assert shape is not None  # a Box has one
    return shape[0]


def _make_sac(
    env: VecEnv, hidden: list[int], settings: TrainingSettings, _: float
) -> tuple[SAC, int]:
    """Make SAC with its entropy weight learned from a small one."""
    rounds = max(1, settings.steps // env.num_envs)
    learner = SAC(
        "MlpPolicy",
        env,
        **_off_policy(env, hidden, settings, rounds=rounds, rate=3e-4),
        ent_coef="auto_0.02",
    )
    return learner, rounds * env.num_envs


def _off_policy(
    env: VecEnv,
    hidden: list[int],
    settings: TrainingSettings,
    *,
    rounds: int,
    rate: float,
) -> dict[str, Any]:
    """Give what TD3 and SAC have in common; `rate` is for presets that have none."""
    preset = _OFF_POLICY[settings.preset]
    return {
        "learning_rate": settings.learning_rate or preset.rate or rate,
        "buffer_size": max(env.num_envs, min(_BUFFER, rounds * env.num_envs)),
        "learning_starts": 0,
        "batch_size": 128,
        "gamma": settings.gamma,
        "train_freq": 1,
        "gradient_steps": max(1, round(env.num_envs * preset.updates)),
        "n_steps": preset.steps_of_return,
        "policy_kwargs": {"net_arch": hidden, "activation_fn": nn.ReLU},
        "seed": settings.seed,
        "device": "cpu",
    }
