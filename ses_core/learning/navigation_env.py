"""`NavigationEnv`: setting a planner's parameters as a Gymnasium environment (leaf: gymnasium)."""

from collections.abc import Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Space

from ses_core.arrays import Float32Array, FloatArray
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.learning.action import ACTIONS, DEFAULT_ACTION, ActionSpec
from ses_core.learning.decision_process import DecisionProcess
from ses_core.learning.observation import ObservationSpec, observation_for
from ses_core.learning.policies import DECISION_PERIOD_S
from ses_core.navigation import NavigationTask
from ses_core.protocols import Simulator
from ses_core.robot_profile import JACKAL, RobotProfile
from ses_core.settings import TrainingSettings

_FIRST_SLOT = np.zeros(1, dtype=np.int64)


def observation_space(spec: ObservationSpec, action: ActionSpec) -> Space[Float32Array]:
    """Give the bounds of an observation as a space."""
    high = spec.bounds(action)
    return cast("Space[Float32Array]", Box(-high, high, dtype=np.float32))


def action_space(action: ActionSpec) -> Space[Float32Array]:
    """Give the space of actions: every parameter scaled to [-1, 1]."""
    box = Box(-1.0, 1.0, shape=(action.length,), dtype=np.float32)
    return cast("Space[Float32Array]", box)


class NavigationEnv(gymnasium.Env[Float32Array, Float32Array]):
    """One robot that a dynamic-window planner drives, and whose parameters are the action.

    ## Description
    A robot drives from a start to a goal through a world it does not know, under a whole
    navigation stack: laser, costmap, global plan, DWA local planner. Every `decision_period_s`
    of the settings, by default once per second, the agent sets some of the planner's parameters
    (APPLR; section IV-A of the paper). One name, the `preset` of the settings, chooses what is
    seen and what is rewarded: `default` is ours, `authors` is that of the SES authors' code
    (ros_jackal), `paper` is that of APPLR: the paper prints neither and refers to APPLR, whose
    own repository the values are from.

    ## Action Space
    `Box(-1, 1, (A,), float32)`, mapped to these; A is 7 or, with the `action` "eight", 8

    | # | parameter | -1 | +1 | unit |
    | --- | --- | --- | --- | --- |
    | 0 | `max_vel_x` | 0.2 | 2.0 | m/s |
    | 1 | `max_vel_theta` | 0.314 | 3.14 | rad/s |
    | 2 | `vx_samples` | 4 | 12 | samples |
    | 3 | `vtheta_samples` | 8 | 40 | samples |
    | 4 | `path_distance_bias` | 0.1 | 1.5 | per m |
    | 5 | `goal_distance_bias` | 0.1 | 2.0 | per m |
    | 6 | `inflation_radius` | 0.1 | 0.6 | m |
    | 7 | `occdist_scale`, linear in its logarithm | 0.001 | 0.2 | per cost |

    ## Observation Space
    `Box((D,), float32)`; a row that a preset lacks is left out, and the rest moves up.

    | what | min | max | `default` | `authors` | `paper` |
    | --- | --- | --- | --- | --- | --- |
    | nearest laser reading per sector, right to left | -0.5 | 0.5 | 120 | 720 | 720 |
    | angle to the local goal, 1 m ahead on the plan | -0.5 | 0.5 | 1 | 1 | 1 |
    | straight distance to the goal, 10 m at most | -0.5 | 0.5 | 1 | | |
    | parameters in force | -1 | 1 | A | | A |
    | D for A = 7 | | | 129 | 721 | 728 |

    Readings r [m] up to c are scaled to r / c - 1/2; c is 4 m in `default`, 2 m in the others.
    The sectors span what the robot's laser sees: 270 degrees on a Jackal, 360 on a TurtleBot 4.
    `ses_core.learning.observation` has the formulas.

    ## Rewards
    w (g after - before) + success - penalty - collision, where *before* and *after* are the way
    made [m], of one decision (`ses_core.learning.reward`).

    | term | `default` | `authors` | `paper` |
    | --- | --- | --- | --- |
    | the way is measured | straight to the goal | along start-goal | along start-goal |
    | w per metre | 1 | 1 | 0.5 |
    | g | 1 | 1 | 0.99 |
    | success, when the goal is reached | 20 | 20 | 10 |
    | penalty, on a collision, a time-out or getting stuck | 20 | 0 | 0 |
    | collision, k / (d + 0.05 m) where d < 0.3 m | k = 0 | k = 0 | k = 0 |

    d is the mean of the 10 nearest readings. With k = 0 and decisions a second apart, a reward
    lies in about [-22, 22]; `failure_penalty` and `collision_weight` of the settings replace
    the penalty and k. Both sources let the robot touch obstacles and go on; here contact ends
    the episode unless `collisions_end` is off. Their start-goal line is the y axis of BARN's
    worlds. APPLR's terms on the parameters themselves (smoothness, extremes) are left out.

    ## Starting State
    A task drawn from the list, its start turned and shifted by a small random amount, the
    robot at rest with the default parameters.

    ## Episode Termination
    Success (within 1 m of the goal), collision, stuck (less than 0.4 m in 40 s), time-out.

    ## Episode Truncation
    Never: the time limit of 100 s belongs to the task, and missing it is a failure.

    ## Arguments
    The simulator (one slot) is made and closed by the caller. Without an `observation` the
    preset's is seen. `info` has the `outcome` and, in seconds, the `time`.
    """

    def __init__(
        self,
        simulator: Simulator,
        *,
        tasks: Sequence[NavigationTask],
        observation: ObservationSpec | None = None,
        profile: RobotProfile = JACKAL,
        settings: TrainingSettings | None = None,
        weights: FloatArray | None = None,
    ) -> None:
        if simulator.slots != 1:
            raise ValueError(f"simulator has {simulator.slots} slots, expected 1")
        settings = settings or TrainingSettings()
        observation = observation or observation_for(settings.preset, profile)
        action = ACTIONS[settings.action or DEFAULT_ACTION]
        self.observation_space = observation_space(observation, action)
        self.action_space = action_space(action)
        self._process = DecisionProcess(
            simulator,
            tasks=tasks,
            observation=observation,
            action=action,
            profile=profile,
            settings=settings,
            decision_period=settings.decision_period_s or DECISION_PERIOD_S,
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
        """Drive until the next decision under the parameters that an action (A,) stands for."""
        decision = self._process.decide(np.asarray(action, dtype=np.float64)[None])
        outcome = EpisodeOutcome(int(decision.outcomes[0]))
        info = {"outcome": outcome.name.lower(), "time": float(decision.times[0])}
        terminated = outcome != EpisodeOutcome.RUNNING
        return self._process.observe()[0], float(decision.rewards[0]), terminated, False, info
