"""Watches a learner: curve, checkpoints, deadline, divergence (leaf: stable-baselines3, torch)."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from typing import Any, Literal, cast

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from ses_core.arrays import Float32Array
from ses_core.learning.algorithms import actor_parameters, extract_policy
from ses_core.learning.checkpoint import pack_checkpoint, restore_checkpoint
from ses_core.learning.policies import ParameterPolicy
from ses_core.learning.training_curve import CurvePoint
from ses_core.learning.vector_env import VectorNavigationEnv

StopReason = Literal["finished", "deadline", "diverged"]

_POINTS = 50
"""Stretches that a training is cut into for its curve."""

_LEAST_EPISODES = 50
"""Fewer episodes in a stretch say too little to call a policy worse."""

_COLLAPSE = 0.3
"""A success rate this much below the best stretch's, twice running, is divergence."""


class TrainingMonitor(BaseCallback):
    """Freezes the actor at first, draws the curve, keeps checkpoints, ends what must end.

    It stops a learner between two steps: the policy is then that of the last whole update.
    """

    def __init__(
        self,
        *,
        start: ParameterPolicy,
        decisions: int,
        frozen_decisions: int,
        checkpoint_decisions: int,
        keep: Callable[[Mapping[str, bytes]], None] | None = None,
        progress: Callable[[float], None],
        deadline: Callable[[], bool],
    ) -> None:
        super().__init__()
        self.curve: list[CurvePoint] = []
        self.reason: StopReason = "finished"
        self.best: ParameterPolicy | None = None
        self._start = start
        self._decisions = decisions
        self._frozen_decisions = frozen_decisions
        self._checkpoint_decisions = checkpoint_decisions
        self._keep = keep
        self._last_checkpoint = 0
        self._progress = progress
        self._deadline = deadline
        self._finished: list[dict[str, Any]] = []
        self._last_point = 0
        self._best_success = -1.0
        self._collapsed = 0

    def resume(self, files: Mapping[str, bytes], learner: BaseAlgorithm) -> None:
        """Go on from a checkpoint.

        Raises:
            ArtifactError: It is damaged, or of another learner.
        """
        watched, kept = restore_checkpoint(files, learner, _navigation_env(learner))
        self.curve = [CurvePoint(**point) for point in watched["curve"]]
        self._finished = watched["finished"]
        self._last_point, self._last_checkpoint = watched["last_point"], learner.num_timesteps
        self._best_success, self._collapsed = watched["best_success"], watched["collapsed"]
        if kept:
            layers = range(len(kept) // 2)
            self.best = replace(
                self._start,
                weights=tuple(cast("Float32Array", kept[f"weight.{number}"]) for number in layers),
                biases=tuple(cast("Float32Array", kept[f"bias.{number}"]) for number in layers),
            )

    def _on_training_start(self) -> None:
        self._freeze(self.num_timesteps < self._frozen_decisions)

    def _on_rollout_start(self) -> None:
        if self.num_timesteps - self._last_checkpoint < self._checkpoint_decisions:
            return
        self._last_checkpoint = self.num_timesteps
        env = _navigation_env(self.model)
        if self._keep is not None:
            self._keep(pack_checkpoint(self.model, env, self._watched(), self._kept()))
        start_anew(self.model)

    def _on_rollout_end(self) -> None:
        # Asked before the update, so that a training of a single rollout trains its actor too.
        if self.num_timesteps >= self._frozen_decisions:
            self._freeze(False)

    def _on_step(self) -> bool:
        self._finished += [info for info in self.locals["infos"] if "outcome" in info]
        if self.num_timesteps - self._last_point >= self._decisions / _POINTS and self._finished:
            self._add_point()
            self._progress(min(1.0, self.num_timesteps / self._decisions))
        if self.reason == "finished" and self._deadline():
            self.reason = "deadline"
        return self.reason == "finished"

    def _on_training_end(self) -> None:
        if self._finished:
            self._add_point()

    def _watched(self) -> dict[str, Any]:
        return {
            "curve": [asdict(point) for point in self.curve],
            "finished": [
                {"outcome": info["outcome"], "episode": info["episode"]} for info in self._finished
            ],
            "last_point": self._last_point,
            "best_success": self._best_success,
            "collapsed": self._collapsed,
        }

    def _kept(self) -> dict[str, Float32Array]:
        """Name the weights of the best policy so far."""
        if self.best is None:
            return {}
        weights = {f"weight.{number}": one for number, one in enumerate(self.best.weights)}
        return weights | {f"bias.{number}": one for number, one in enumerate(self.best.biases)}

    def _add_point(self) -> None:
        outcomes = np.array([info["outcome"] for info in self._finished])
        times = np.array([info["episode"]["t"] for info in self._finished])
        success = outcomes == "success"
        point = CurvePoint(
            steps=self.num_timesteps,
            episodes=len(outcomes),
            mean_return=float(np.mean([info["episode"]["r"] for info in self._finished])),
            success_rate=float(success.mean()),
            collision_rate=float((outcomes == "collision").mean()),
            mean_time_s=float(times[success].mean()) if success.any() else None,
        )
        self.curve.append(point)
        self._finished = []
        self._last_point = self.num_timesteps
        self._watch(point)

    def _watch(self, point: CurvePoint) -> None:
        """Keep the best policy so far, and stop where the present one has fallen far behind."""
        policy = extract_policy(self.model, self._start)
        if not all(np.isfinite(array).all() for array in (*policy.weights, *policy.biases)):
            self.reason = "diverged"
            return
        if self.best is None:
            self.best = policy
        if point.episodes < _LEAST_EPISODES:
            return
        if point.success_rate > self._best_success:
            self.best, self._best_success = policy, point.success_rate
        is_low = point.success_rate < self._best_success - _COLLAPSE
        self._collapsed = self._collapsed + 1 if is_low else 0
        if self._collapsed >= 2:
            self.reason = "diverged"

    def _freeze(self, is_frozen: bool) -> None:
        for parameter in actor_parameters(self.model):
            parameter.requires_grad_(not is_frozen)


def start_anew(learner: BaseAlgorithm) -> None:
    """Restart every robot between two rollouts; what it was doing counts as cut short."""
    if isinstance(learner, OffPolicyAlgorithm):
        buffer = cast("ReplayBuffer", learner.replay_buffer)
        last = buffer.pos - 1
        buffer.timeouts[last] = np.maximum(buffer.timeouts[last], 1.0 - buffer.dones[last])
    env = _navigation_env(learner)
    learner._last_obs = env.reset()
    learner._last_episode_starts = np.ones(env.num_envs, dtype=bool)


def _navigation_env(learner: BaseAlgorithm) -> VectorNavigationEnv:
    return cast("VectorNavigationEnv", learner.get_env())
