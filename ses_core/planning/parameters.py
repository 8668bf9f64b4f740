"""`PlannerParameters`: what may be set while the robot drives, under `move_base` names."""

from dataclasses import astuple, dataclass, fields

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.robot_profile import RobotProfile

ROBOTS_OWN = -1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParameters:
    """One setting of the planner; defaults are the Jackal's, which the paper calls DWA slow.

    Attributes:
        occdist_scale: Below 0 leaves it to the robot's profile.
    """

    max_vel_x: float = 0.5
    max_vel_theta: float = 1.57
    vx_samples: float = 6.0
    vtheta_samples: float = 20.0
    path_distance_bias: float = 0.75
    goal_distance_bias: float = 1.0
    inflation_radius: float = 0.3
    occdist_scale: float = ROBOTS_OWN

    def as_array(self) -> FloatArray:
        """Give the parameters (8,) in their declared order."""
        return np.array(astuple(self), dtype=np.float64)


PARAMETER_NAMES = tuple(field.name for field in fields(PlannerParameters))

PARAMETER_UNITS = dict(
    zip(
        PARAMETER_NAMES,
        ("m/s", "rad/s", "samples", "samples", "per m", "per m", "m", "per cost"),
        strict=True,
    )
)

DWA_SLOW = PlannerParameters()
"""The Jackal's defaults (section IV-C)."""

DWA_FAST = PlannerParameters(max_vel_x=1.0, vx_samples=12.0)
"""Twice the speed and twice the sampling rate (section IV-C)."""


def initial_parameters(count: int, profile: RobotProfile) -> FloatArray:
    """Parameters (count, 8) in force before the first decision: the robot's defaults."""
    parameters = DWA_SLOW.as_array()
    parameters[PARAMETER_NAMES.index("occdist_scale")] = profile.planner.occdist_scale
    return np.tile(parameters, (count, 1))
