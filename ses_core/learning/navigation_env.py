"""`NavigationEnv`: setting a planner's parameters as a Gymnasium environment (leaf: gymnasium)."""

from collections.abc import Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Space

from ses_core.arrays import Float32Array, FloatArray
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.learning.decision_process import DecisionProcess
from ses_core.learning.observation import DEFAULT_OBSERVATION, ObservationSpec
from ses_core.navigation import NavigationTask
from ses_core.planning.parameters import PARAMETER_NAMES
from ses_core.protocols import Simulator
from ses_core.robot_profile import JACKAL, RobotProfile
from ses_core.settings import TrainingSettings

_FIRST_SLOT = np.zeros(1, dtype=np.int64)


def observation_space(spec: ObservationSpec) -> Space[Float32Array]:
    """Give the bounds of an observation as a space."""
    return cast("Space[Float32Array]", Box(spec.low(), spec.high(), dtype=np.float32))


def action_space() -> Space[Float32Array]:
    """Give the space of actions: every parameter scaled to [-1, 1]."""
    box = Box(-1.0, 1.0, shape=(len(PARAMETER_NAMES),), dtype=np.float32)
    return cast("Space[Float32Array]", box)


class NavigationEnv(gymnasium.Env[Float32Array, Float32Array]):
    """One robot that a dynamic-window planner drives, and whose parameters are the action.

    ## Description
    A robot drives from a start to a goal through a world it does not know, under a whole
    navigation stack: laser, costmap, global plan, DWA local planner. Once per second the agent
    sets seven of the planner's parameters (APPLR; section IV-A of the paper).

    ## Action Space
    `Box(-1, 1, (7,), float32)`, mapped linearly to

    | # | parameter | -1 | +1 | unit |
    | --- | --- | --- | --- | --- |
    | 0 | `max_vel_x` | 0.2 | 2.0 | m/s |
    | 1 | `max_vel_theta` | 0.314 | 3.14 | rad/s |
    | 2 | `vx_samples` | 4 | 12 | samples |
    | 3 | `vtheta_samples` | 8 | 40 | samples |
    | 4 | `path_distance_bias` | 0.1 | 1.5 | per m |
    | 5 | `goal_distance_bias` | 0.1 | 2.0 | per m |
    | 6 | `inflation_radius` | 0.1 | 0.6 | m |

    ## Observation Space
    `Box((129,), float32)` by default; `ses_core.learning.observation` has the units.

    | # | what | min | max |
    | --- | --- | --- | --- |
    | 0-119 | nearest laser reading per sector, right to left | -0.5 | 0.5 |
    | 120 | angle to the local goal | -0.5 | 0.5 |
    | 121 | distance to the goal | -0.5 | 0.5 |
    | 122-128 | parameters in force | -1 | 1 |

    ## Rewards
    Metres of progress towards the goal in that second (at most about 2), +20 on success,
    minus the failure penalty (20) on a collision, a time-out or getting stuck.

    ## Starting State
    A task drawn from the list, its start turned and shifted by a small random amount, the
    robot at rest with the default parameters.

    ## Episode Termination
    Success (within 1 m of the goal), collision, stuck (less than 0.4 m in 40 s), time-out.

    ## Episode Truncation
    Never: the time limit of 100 s belongs to the task, and missing it is a failure.

    ## Arguments
    The simulator (one slot) is made and closed by the caller; `info` has the `outcome` and,
    in seconds, the `time`.
    """

    def __init__(
        self,
        simulator: Simulator,
        *,
        tasks: Sequence[NavigationTask],
        observation: ObservationSpec = DEFAULT_OBSERVATION,
        profile: RobotProfile = JACKAL,
        settings: TrainingSettings | None = None,
        weights: FloatArray | None = None,
    ) -> None:
        if simulator.slots != 1:
            raise ValueError(f"simulator has {simulator.slots} slots, expected 1")
        self.observation_space = observation_space(observation)
        self.action_space = action_space()
        self._process = DecisionProcess(
            simulator,
            tasks=tasks,
            observation=observation,
            profile=profile,
            settings=settings or TrainingSettings(),
            weights=weights,
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32Array, dict[str, Any]]:
        """Start an episode; a seed decides its task, its jitter and its noise."""
        super().reset(seed=seed, options=options)
        self._process.restart(_FIRST_SLOT, rng=self.np_random)
        return self._process.observe()[0], {}

    def step(self, action: Float32Array) -> tuple[Float32Array, float, bool, bool, dict[str, Any]]:
        """Drive for a second under the parameters that an action (7,) stands for."""
        decision = self._process.decide(np.asarray(action, dtype=np.float64)[None])
        outcome = EpisodeOutcome(int(decision.outcomes[0]))
        info = {"outcome": outcome.name.lower(), "time": float(decision.times[0])}
        terminated = outcome != EpisodeOutcome.RUNNING
        return self._process.observe()[0], float(decision.rewards[0]), terminated, False, info
