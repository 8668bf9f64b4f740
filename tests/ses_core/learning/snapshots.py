"""A state of N robots written down by hand, for what reads states and never moves them."""

from dataclasses import dataclass, field

import numpy as np

from ses_core.arrays import FloatArray, IntArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """Fields of `ses_core.protocols.SimulatorState`."""

    poses: FloatArray
    odometry: FloatArray = field(default_factory=lambda: np.zeros((1, 3)))
    goals: FloatArray
    local_goals: FloatArray
    velocities: FloatArray = field(default_factory=lambda: np.zeros((1, 2)))
    commands: FloatArray = field(default_factory=lambda: np.zeros((1, 2)))
    times: FloatArray = field(default_factory=lambda: np.zeros(1))
    path_lengths: FloatArray = field(default_factory=lambda: np.zeros(1))
    negative_counts: IntArray = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    not_forward_counts: IntArray = field(default_factory=lambda: np.zeros(1, dtype=np.int64))
    outcomes: IntArray = field(default_factory=lambda: np.zeros(1, dtype=np.int64))


def looking_at(goal: tuple[float, float], local_goal: tuple[float, float]) -> Snapshot:
    """One robot at the origin, facing along x."""
    return Snapshot(
        poses=np.zeros((1, 3)), goals=np.array([goal]), local_goals=np.array([local_goal])
    )
