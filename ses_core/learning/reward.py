"""`RewardSpec`: what a decision earns, by the way it made and by how the episode ends.

    reward = progress_weight * (progress_discount * way after - way before)
             + success                       if the goal was reached
             - failure_penalty               if the episode failed (collision, time-out or stuck)
             - collision_weight / (d + 0.05) if d, the mean of the 10 nearest readings, is < 0.3 m

The *way* [m] is minus the straight distance to the goal, or how far the robot has come along the
straight line from start to goal.
"""

from typing import Literal

import numpy as np
from pydantic import Field

from ses_core.arrays import Float32Array, FloatArray, IntArray
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.learning.observation import goal_distances
from ses_core.protocols import SimulatorState
from ses_core.settings import TrainingSettings
from ses_core.settings_model import SettingsModel

NEAREST_READINGS = 10
"""Readings whose mean says how near the nearest obstacle is (ros_jackal's `dwa_base_envs.py`)."""

NEAR_M = 0.3
"""Nearer than this costs, where nearness costs at all; same source."""

_NEAR_OFFSET_M = 0.05
"""Keeps that cost finite; same source."""


class RewardSpec(SettingsModel):
    """The terms of a reward and their weights; it is kept with every policy."""

    name: str = Field(description="Name of the preset.")
    progress: Literal["distance", "direction"] = Field(
        description="The way is measured by the straight distance to the goal [m], or along the "
        "straight line from start to goal [m]."
    )
    progress_weight: float = Field(1.0, ge=0, description="Reward per metre made [1/m].")
    progress_discount: float = Field(
        1.0, gt=0, le=1, description="Factor on the way after the decision; below 1, time costs."
    )
    success: float = Field(ge=0, description="Added when the goal is reached.")
    failure_penalty: float = Field(0.0, ge=0, description="Taken off when the episode fails.")
    collision_weight: float = Field(0.0, ge=0, description="Weight of nearness [m]; 0: it is free.")


DEFAULT_REWARD = RewardSpec(name="default", progress="distance", success=20.0, failure_penalty=20.0)
"""Without a penalty, a discount trades success for speed."""

AUTHORS_REWARD = RewardSpec(name="authors", progress="direction", success=20.0)
"""ros_jackal, the SES authors' code: `ShapingRewardWrapper` and `configs/laser.yaml`."""

PAPER_REWARD = RewardSpec(
    name="paper", progress="direction", progress_weight=0.5, progress_discount=0.99, success=10.0
)
"""The paper prints no reward and refers to APPLR: `BenchMarkingWrapperReward` of its repository
with `continuous/configs/td3_condor.json`, without the terms on the parameters themselves."""

REWARDS = {spec.name: spec for spec in (DEFAULT_REWARD, AUTHORS_REWARD, PAPER_REWARD)}


def reward_of(settings: TrainingSettings) -> RewardSpec:
    """Give the reward of a training: its preset's, with what the settings put in its place."""
    asked = {
        "failure_penalty": settings.failure_penalty,
        "collision_weight": settings.collision_weight,
    }
    changes = {name: value for name, value in asked.items() if value is not None}
    return REWARDS[settings.preset].model_copy(update=changes)


def way_made(spec: RewardSpec, state: SimulatorState, starts: FloatArray) -> FloatArray:
    """Measure the way (N,) [m] that robots have made from their starts (N, 2) [m]."""
    if spec.progress == "distance":
        return -goal_distances(state)
    course = state.goals - starts
    length = np.hypot(course[:, 0], course[:, 1])
    along: FloatArray = np.sum((state.poses[:, :2] - starts) * course, axis=1)
    return along / np.maximum(length, 1e-9)


def nearness(scans: Float32Array, *, least_range: float) -> FloatArray:
    """Give the mean of the nearest readings (N,) [m] of scans (N, B) [m].

    Readings below the laser's least range [m], or not finite, are none; a scan with too few
    readings has nothing near it: inf.
    """
    readings = np.where(scans >= least_range, scans, np.inf).astype(np.float64)
    nearest = np.sort(readings, axis=1)[:, :NEAREST_READINGS]
    mean: FloatArray = nearest.mean(axis=1)
    return mean


def rewards(
    spec: RewardSpec,
    *,
    before: FloatArray,
    after: FloatArray,
    outcomes: IntArray,
    near: FloatArray,
) -> FloatArray:
    """Reward one decision of each of N robots.

    Args:
        spec: Terms and weights.
        before: Way made (N,) [m] when the parameters were set.
        after: Way made (N,) [m] one decision later.
        outcomes: `EpisodeOutcome` values (N,).
        near: What `nearness` says one decision later (N,) [m].
    """
    succeeded = outcomes == EpisodeOutcome.SUCCESS
    failed = ~succeeded & (outcomes != EpisodeOutcome.RUNNING)
    ending = np.where(succeeded, spec.success, np.where(failed, -spec.failure_penalty, 0.0))
    progress = spec.progress_weight * (spec.progress_discount * after - before)
    cost = np.where(near < NEAR_M, spec.collision_weight / (near + _NEAR_OFFSET_M), 0.0)
    return progress + ending - cost
