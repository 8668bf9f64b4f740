"""`VectorNavigationEnv`: N robots in one process as stable-baselines3 wants them (a leaf).

Transport through an array costs nothing beside the simulation; worker processes with pipes
carry 100 environments 10,000 times slower, and each would hold its own copy of torch.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.random import Generator
from stable_baselines3.common.vec_env import VecEnv

from ses_core.arrays import BoolArray, Float32Array
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.learning.decision_process import DecisionProcess
from ses_core.learning.navigation_env import action_space, observation_space

REWARD_SCALE = 0.1
"""What learners see is scaled: returns near 1 keep the critic's gradients at the actor's size."""


class VectorNavigationEnv(VecEnv):
    """`NavigationEnv` with N slots; a finished slot starts over in a newly drawn task.

    The `infos` of a finished episode hold `episode` (`r` the unscaled return, `l` decisions,
    `t` seconds of driving), `outcome` and `terminal_observation`.
    """

    render_mode = None

    def __init__(self, process: DecisionProcess, *, rng: Generator) -> None:
        super().__init__(
            process.simulator.slots,
            observation_space(process.observation, process.action),
            action_space(process.action),
        )
        self._process = process
        self._rng = rng
        self._actions = np.zeros((self.num_envs, process.action.length))
        self._returns = np.zeros(self.num_envs)
        self._lengths = np.zeros(self.num_envs, dtype=np.int64)

    def reset(self) -> Float32Array:
        """Start an episode in every slot."""
        self._process.restart(np.arange(self.num_envs), rng=self._rng)
        self._returns[:] = 0.0
        self._lengths[:] = 0
        return self._process.observe()

    def step_async(self, actions: Float32Array) -> None:
        """Take the actions (N, A) of the next step."""
        self._actions = np.asarray(actions, dtype=np.float64)

    def step_wait(self) -> tuple[Float32Array, Float32Array, BoolArray, list[dict[str, Any]]]:
        """Drive every robot until the next decision and start finished ones over."""
        decision = self._process.decide(self._actions)
        self._returns += decision.rewards
        self._lengths += 1
        done = decision.outcomes != EpisodeOutcome.RUNNING
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        observations = self._process.observe()
        finished = np.flatnonzero(done)
        for slot in finished:
            infos[slot] = {
                "terminal_observation": observations[slot],
                "outcome": EpisodeOutcome(int(decision.outcomes[slot])).name.lower(),
                "episode": {
                    "r": float(self._returns[slot]),
                    "l": int(self._lengths[slot]),
                    "t": float(decision.times[slot]),
                },
            }
        if len(finished):
            self._process.restart(finished, rng=self._rng)
            self._returns[finished] = 0.0
            self._lengths[finished] = 0
            observations = self._process.observe()
        return observations, (REWARD_SCALE * decision.rewards).astype(np.float32), done, infos

    @property
    def random_state(self) -> dict[str, Any]:
        """State of the generator that draws tasks and starts, as JSON values."""
        return dict(self._rng.bit_generator.state)

    @random_state.setter
    def random_state(self, state: dict[str, Any]) -> None:
        self._rng.bit_generator.state = state

    def close(self) -> None:
        """Do nothing: whoever made the simulator closes it."""

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """Give an attribute of this object once per slot asked for."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, *_: Any, **__: Any) -> None:
        """Refuse: slots have no attributes of their own."""
        raise ValueError(f"slots have no attribute {attr_name!r} to set")

    def env_method(self, method_name: str, *_: Any, **__: Any) -> list[Any]:
        """Refuse: slots have no methods of their own."""
        raise ValueError(f"slots have no method {method_name!r}")

    def env_is_wrapped(self, _: type, indices: int | Iterable[int] | None = None) -> list[bool]:
        """Tell that no slot is wrapped."""
        return [False for _ in self._get_indices(indices)]
