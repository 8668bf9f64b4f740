"""Policies: fixed planner parameters (DWA slow, DWA fast) and the learned `ParameterPolicy`."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ses_core.arrays import Float32Array, FloatArray
from ses_core.learning.action import SEVEN, ActionSpec
from ses_core.learning.observation import (
    DEFAULT_OBSERVATION,
    ObservationSpec,
    Observer,
    make_observer,
)
from ses_core.planning.parameters import DWA_FAST, DWA_SLOW, PlannerParameters
from ses_core.protocols import Policy
from ses_core.robot_profile import RobotProfile

DECISION_PERIOD_S = 1.0
"""Unless it was trained otherwise, a policy sets the parameters once per second of driving
(`time_step` of ros_jackal and of APPLR)."""

HIDDEN_SIZES = {"authors": (512, 512), "paper": (512, 512), "default": (256, 256)}
"""Hidden layers by preset: ros_jackal's `configs/laser.yaml`, APPLR's `td3_condor.json` (which has
convolutions before them), ours."""


@dataclass(frozen=True, slots=True)
class FixedParameters:
    """The classical baseline: one parameter vector, whatever is seen."""

    parameters: PlannerParameters

    def act(self, observations: FloatArray) -> FloatArray:
        """Give the same parameters (N, 8) to every robot."""
        return np.tile(self.parameters.as_array(), (len(observations), 1))


FIXED_POLICIES = {
    "dwa-slow": FixedParameters(DWA_SLOW),
    "dwa-fast": FixedParameters(DWA_FAST),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterPolicy:
    """pi: a perceptron from an observation to planner parameters (APPLR, section IV-A).

    Hidden layers are rectified, the output is a hyperbolic tangent: an action in [-1, 1]^A.

    Attributes:
        observation: Layout of what it sees.
        action: What it sets.
        weights: One (out, in) float32 matrix per layer.
        biases: One (out,) float32 vector per layer.
        decision_period: Driving between two decisions that it was trained for [s].
    """

    observation: ObservationSpec
    weights: tuple[Float32Array, ...]
    biases: tuple[Float32Array, ...]
    action: ActionSpec = SEVEN
    decision_period: float = DECISION_PERIOD_S

    def __post_init__(self) -> None:
        if not (np.isfinite(self.decision_period) and self.decision_period > 0.0):
            raise ValueError(
                f"policy decides every {self.decision_period} s, expected more than 0 s"
            )
        width = self.observation.length(self.action)
        for number, (matrix, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            if matrix.ndim != 2 or matrix.shape[1] != width or bias.shape != matrix.shape[:1]:
                raise ValueError(
                    f"layer {number} has shapes {matrix.shape} and {bias.shape}, "
                    f"expected (n, {width}) and (n,)"
                )
            width = matrix.shape[0]
        if width != self.action.length:
            raise ValueError(f"policy has {width} outputs, expected {self.action.length}")

    @property
    def hidden_sizes(self) -> tuple[int, ...]:
        """Widths of the hidden layers."""
        return tuple(len(bias) for bias in self.biases[:-1])

    def actions(self, observations: FloatArray) -> FloatArray:
        """Map observations (N, D) to actions (N, A) in [-1, 1]."""
        signal = np.asarray(observations, dtype=np.float64)
        for matrix, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            signal = np.maximum(signal @ matrix.T.astype(np.float64) + bias, 0.0)
        output: FloatArray = np.tanh(
            signal @ self.weights[-1].T.astype(np.float64) + self.biases[-1]
        )
        # Matrix products differ in their last bits with the number of rows. Rounded, a robot
        # decides the same however many are decided for together.
        return output.round(7)

    def act(self, observations: FloatArray) -> FloatArray:
        """Map observations (N, D) to planner parameters (N, 8)."""
        return self.action.decode(self.actions(observations))


def random_policy(
    observation: ObservationSpec,
    hidden_sizes: tuple[int, ...],
    *,
    rng: Generator,
    action: ActionSpec = SEVEN,
) -> ParameterPolicy:
    """Draw an untrained policy whose parameters stay near the middle of their bounds."""
    widths = (observation.length(action), *hidden_sizes, action.length)
    scales = [np.sqrt(2.0 / fan_in) for fan_in in widths[:-2]] + [0.01]
    weights = tuple(
        (scale * rng.standard_normal((after, before))).astype(np.float32)
        for scale, before, after in zip(scales, widths[:-1], widths[1:], strict=True)
    )
    biases = tuple(np.zeros(width, dtype=np.float32) for width in widths[1:])
    return ParameterPolicy(observation=observation, weights=weights, biases=biases, action=action)


def observer_for(policy: Policy, profile: RobotProfile) -> Observer:
    """Give what a policy sees the world through on a robot; fixed parameters ignore it."""
    if isinstance(policy, ParameterPolicy):
        return make_observer(policy.observation, profile, action=policy.action)
    return make_observer(DEFAULT_OBSERVATION, profile, action=SEVEN)


def decision_ticks(period: float, time_step: float) -> int:
    """Give the control ticks of a time step [s] between two decisions a period [s] apart."""
    return max(1, round(period / time_step))


def policy_ticks(policy: Policy, time_step: float) -> int:
    """Give the control ticks between two decisions of a policy, as it was trained.

    Fixed parameters are the same whenever they are set.
    """
    period = policy.decision_period if isinstance(policy, ParameterPolicy) else DECISION_PERIOD_S
    return decision_ticks(period, time_step)
