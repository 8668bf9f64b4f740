"""`PlannerParameters`: what the policy may set, under `move_base` names, and its bounds."""

from dataclasses import astuple, dataclass, fields

import numpy as np

from ses_core.arrays import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParameters:
    """The seven learned parameters; defaults are the Jackal's, which the paper calls DWA slow."""

    max_vel_x: float = 0.5
    max_vel_theta: float = 1.57
    vx_samples: float = 6.0
    vtheta_samples: float = 20.0
    path_distance_bias: float = 0.75
    goal_distance_bias: float = 1.0
    inflation_radius: float = 0.3

    def as_array(self) -> FloatArray:
        """Give the parameters (7,) in their declared order."""
        return np.array(astuple(self), dtype=np.float64)


PARAMETER_NAMES = tuple(field.name for field in fields(PlannerParameters))

PARAMETER_UNITS = ("m/s", "rad/s", "samples", "samples", "per m", "per m", "m")

PARAMETER_LOW = np.array([0.2, 0.314, 4.0, 8.0, 0.1, 0.1, 0.1])
"""Lower bounds (7,): ros_jackal's `parameter_tuning_envs.py`, the SES authors' code."""

PARAMETER_HIGH = np.array([2.0, 3.14, 12.0, 40.0, 1.5, 2.0, 0.6])
"""Upper bounds (7,), from the same source."""

DWA_SLOW = PlannerParameters()
"""The Jackal's defaults (section IV-C)."""

DWA_FAST = PlannerParameters(max_vel_x=1.0, vx_samples=12.0)
"""Twice the speed and twice the sampling rate (section IV-C)."""


def decode_action(action: FloatArray) -> FloatArray:
    """Map actions (..., 7) in [-1, 1] to parameters in their bounds; outside is clipped."""
    unit = (np.clip(action, -1.0, 1.0) + 1.0) / 2.0
    return PARAMETER_LOW + unit * (PARAMETER_HIGH - PARAMETER_LOW)


def encode_parameters(parameters: FloatArray) -> FloatArray:
    """Map parameters (..., 7) to actions in [-1, 1]: the inverse of `decode_action`."""
    unit = (np.asarray(parameters) - PARAMETER_LOW) / (PARAMETER_HIGH - PARAMETER_LOW)
    return np.clip(2.0 * unit - 1.0, -1.0, 1.0)
