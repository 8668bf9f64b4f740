"""Trajectory -> scenarios, by distance from the initial step (Algorithm 2)."""

import math
from itertools import pairwise
from typing import Literal

import numpy as np

from ses_core.arrays import FloatArray, IntArray
from ses_core.compilation import compiled
from ses_core.extraction.scenario import Scenario
from ses_core.extraction.trajectory import Trajectory, known_steps, negative_steps
from ses_core.geometry import Pose2D
from ses_core.settings import ExtractionSettings

UNKNOWN_STEPS_SHARE = 0.02
"""With a larger share of steps of unknown velocity the counts of a scenario are null."""

REST_WINDOW_NS = 1_000_000_000
"""A terminal segment is at rest when its last second ..."""

REST_DISTANCE_M = 0.05
"""... moved the robot less than this [m]."""


def segment(
    trajectory: Trajectory, *, settings: ExtractionSettings, ends_in_cut: bool = False
) -> list[Scenario]:
    """Cut a trajectory wherever the robot has left its last cut behind.

    A scenario closes at the first step strictly farther than `settings.distance_m` from its
    initial step; that step is the next initial step and is counted once, by the scenario it
    closes. An unfinished rest becomes the `terminal` segment. (Algorithm 2, lines 5-15; the
    paper drops the rest.)

    Counts run over the steps after the initial one. They are None where the log has no clock,
    or where the velocity of more than `UNKNOWN_STEPS_SHARE` of the steps is unknown; below
    that share the unknown steps count as moving forward. `ends_in_cut` says that a gap or a
    jump ended the trajectory, not the end of the log.
    """
    if len(trajectory) < 2:
        return []
    cuts = closing_steps(np.ascontiguousarray(trajectory.poses[:, :2]), settings.distance_m)
    sums = _RunningSums(trajectory, settings)
    edges = [0, *cuts.tolist()]
    scenarios = [
        _scenario("scenario", trajectory, sums, first, last) for first, last in pairwise(edges)
    ]
    final = len(trajectory) - 1
    if edges[-1] < final:
        outcome = "cut" if ends_in_cut else _rest_outcome(trajectory, edges[-1])
        scenarios.append(_scenario("terminal", trajectory, sums, edges[-1], final, outcome=outcome))
    return scenarios


@compiled
def closing_steps(positions: FloatArray, distance: float) -> IntArray:
    """Find the steps that close scenarios, from positions (K, 2) [m] and a distance [m]."""
    cuts = np.empty(positions.shape[0], dtype=np.int64)
    count = 0
    initial = 0
    for step in range(1, positions.shape[0]):
        dx = positions[step, 0] - positions[initial, 0]
        dy = positions[step, 1] - positions[initial, 1]
        if dx * dx + dy * dy > distance * distance:
            cuts[count] = step
            count += 1
            initial = step
    return cuts[:count].copy()


class _RunningSums:
    """Sums up to each step, so that any span is one subtraction."""

    def __init__(self, trajectory: Trajectory, settings: ExtractionSettings) -> None:
        negative = negative_steps(trajectory)
        known = known_steps(trajectory)
        with np.errstate(invalid="ignore"):
            not_forward = trajectory.speed <= settings.not_forward_speed_mps
        steps = np.diff(trajectory.poses[:, :2], axis=0)
        lengths = np.concatenate(([0.0], np.hypot(steps[:, 0], steps[:, 1])))
        periods = np.concatenate(([0], np.diff(trajectory.stamps_ns)))
        self.unknown = np.cumsum(~known)
        self.negative = np.cumsum(negative)
        self.not_forward = np.cumsum(not_forward)
        self.reversing_ns = np.cumsum(np.where(negative, periods, 0))
        self.arc_length = np.cumsum(lengths)


def _scenario(
    kind: Literal["scenario", "terminal"],
    trajectory: Trajectory,
    sums: _RunningSums,
    first: int,
    last: int,
    *,
    outcome: str = "",
) -> Scenario:
    unknown = int(sums.unknown[last] - sums.unknown[first])
    is_counted = trajectory.has_clock and unknown <= UNKNOWN_STEPS_SHARE * (last - first)
    duration_ns = int(trajectory.stamps_ns[last] - trajectory.stamps_ns[first])
    reversing_ns = int(sums.reversing_ns[last] - sums.reversing_ns[first])
    x, y, yaw = trajectory.poses[first]
    return Scenario(
        kind=kind,
        first_step=trajectory.first_step + first,
        last_step=trajectory.first_step + last,
        start_stamp_ns=int(trajectory.stamps_ns[first]),
        duration_s=duration_ns / 1e9 if trajectory.has_clock else math.nan,
        arc_length_m=float(sums.arc_length[last] - sums.arc_length[first]),
        start=Pose2D(float(x), float(y), float(yaw)),
        goal=(float(trajectory.poses[last, 0]), float(trajectory.poses[last, 1])),
        negative_velocity_count=(
            int(sums.negative[last] - sums.negative[first]) if is_counted else None
        ),
        not_forward_count=(
            int(sums.not_forward[last] - sums.not_forward[first]) if is_counted else None
        ),
        reversing_s=reversing_ns / 1e9 if is_counted else None,
        outcome=outcome,
    )


def _rest_outcome(trajectory: Trajectory, first: int) -> str:
    """Tell whether the last second of a terminal segment was spent at rest."""
    since = int(
        np.searchsorted(trajectory.stamps_ns, trajectory.stamps_ns[-1] - REST_WINDOW_NS, "left")
    )
    last_second = trajectory.poses[max(first, since) :, :2]
    moved = np.hypot(*(last_second - last_second[-1]).T).max()
    return "stopped" if moved < REST_DISTANCE_M else "moving"
