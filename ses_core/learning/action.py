"""`ActionSpec`: which planner parameters a policy sets, within which bounds, on which scale.

An action is a number in [-1, 1] for each of A parameters; -1 stands for the lower bound, 1 for the
upper one, and what lies between is linear in the parameter or in its logarithm.
"""

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from ses_core.arrays import BoolArray, FloatArray, IntArray
from ses_core.planning.parameters import DWA_SLOW, PARAMETER_NAMES
from ses_core.settings_model import SettingsModel


class ActionParameter(SettingsModel):
    """One parameter that a policy sets."""

    name: str = Field(description="Its name in `move_base`.")
    low: float = Field(description="Lower bound, in the parameter's own unit.")
    high: float = Field(description="Upper bound.")
    scale: Literal["linear", "log"] = Field("linear", description="What an action is linear in.")

    @model_validator(mode="after")
    def _is_settable(self) -> "ActionParameter":
        if self.name not in PARAMETER_NAMES:
            raise ValueError(
                f"the planner has no parameter {self.name!r}, expected {', '.join(PARAMETER_NAMES)}"
            )
        if not self.low < self.high or (self.scale == "log" and self.low <= 0):
            raise ValueError(
                f"{self.name} is bounded by {self.low} and {self.high} on a {self.scale} scale, "
                "expected the first to be less, and more than 0 on a log scale"
            )
        return self


class ActionSpec(SettingsModel):
    """The parameters of an action in their order; it travels with every policy."""

    name: str = Field(description="Name of the set.")
    parameters: tuple[ActionParameter, ...] = Field(min_length=1, description="What is set.")

    @property
    def length(self) -> int:
        """A, the length of an action."""
        return len(self.parameters)

    @property
    def names(self) -> tuple[str, ...]:
        """Names (A,) of the parameters."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def places(self) -> IntArray:
        """Where the parameters (A,) stand among the planner's."""
        return np.array([PARAMETER_NAMES.index(name) for name in self.names])

    @property
    def is_log(self) -> BoolArray:
        """Which of the parameters (A,) have a logarithmic scale."""
        return np.array([parameter.scale == "log" for parameter in self.parameters])

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Give lower and upper bounds (A,) on the scales, logarithms where they are such."""
        bounds = np.array([(parameter.low, parameter.high) for parameter in self.parameters])
        bounds[self.is_log] = np.log(bounds[self.is_log])
        return bounds[:, 0], bounds[:, 1]

    def decode(self, actions: FloatArray) -> FloatArray:
        """Map actions (N, A) to planner parameters (N, 8); outside [-1, 1] is clipped.

        What is not set is DWA slow's.
        """
        low, high = self.bounds()
        values = low + (np.clip(actions, -1.0, 1.0) + 1.0) / 2.0 * (high - low)
        values[:, self.is_log] = np.exp(values[:, self.is_log])
        parameters = np.tile(DWA_SLOW.as_array(), (len(values), 1))
        parameters[:, self.places] = values
        return parameters

    def encode(self, parameters: FloatArray) -> FloatArray:
        """Map planner parameters (N, 8) to actions (N, A): the inverse of `decode`."""
        low, high = self.bounds()
        values = np.asarray(parameters)[:, self.places]
        values[:, self.is_log] = np.log(np.maximum(values[:, self.is_log], 1e-12))
        clipped: FloatArray = np.clip(2.0 * (values - low) / (high - low) - 1.0, -1.0, 1.0)
        return clipped


SEVEN = ActionSpec(
    name="seven",
    parameters=(
        ActionParameter(name="max_vel_x", low=0.2, high=2.0),
        ActionParameter(name="max_vel_theta", low=0.314, high=3.14),
        ActionParameter(name="vx_samples", low=4.0, high=12.0),
        ActionParameter(name="vtheta_samples", low=8.0, high=40.0),
        ActionParameter(name="path_distance_bias", low=0.1, high=1.5),
        ActionParameter(name="goal_distance_bias", low=0.1, high=2.0),
        ActionParameter(name="inflation_radius", low=0.1, high=0.6),
    ),
)
"""ros_jackal's `parameter_tuning_envs.py`, the SES authors' code."""

EIGHT = ActionSpec(
    name="eight",
    parameters=(
        *SEVEN.parameters,
        ActionParameter(name="occdist_scale", low=0.001, high=0.2, scale="log"),
    ),
)
"""With the weight of obstacles, which causes most failures at its default of 0.1.

APPLR's repository has such a variant from 0.05 to 1; what serves lies below, at 0.005 to 0.02,
hence the bounds and the logarithm."""

ACTIONS = {spec.name: spec for spec in (SEVEN, EIGHT)}

DEFAULT_ACTION = "seven"
"""What a policy without a parent sets, unless the settings say otherwise."""
