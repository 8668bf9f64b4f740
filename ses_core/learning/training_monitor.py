"""Watches a learner: learning curve, deadline, divergence (leaf: stable-baselines3, torch)."""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from ses_core.learning.algorithms import actor_parameters, extract_policy
from ses_core.learning.policies import ParameterPolicy
from ses_core.learning.training_curve import CurvePoint

StopReason = Literal["finished", "deadline", "diverged"]

_POINTS = 50
"""Stretches that a training is cut into for its curve."""

_LEAST_EPISODES = 50
"""Fewer episodes in a stretch say too little to call a policy worse."""

_COLLAPSE = 0.3
"""A success rate this much below the best stretch's, twice running, is divergence."""


class TrainingMonitor(BaseCallback):
    """Freezes the actor at first, draws the curve, and ends a training that must end.

    It stops a learner between two steps: the policy is then that of the last whole update.
    """

    def __init__(
        self,
        *,
        start: ParameterPolicy,
        decisions: int,
        frozen_decisions: int,
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
        self._progress = progress
        self._deadline = deadline
        self._finished: list[dict[str, Any]] = []
        self._last_point = 0
        self._best_success = -1.0
        self._collapsed = 0

    def _on_training_start(self) -> None:
        self._freeze(self._frozen_decisions > 0)

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
