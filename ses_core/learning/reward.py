"""What training rewards: way made towards the goal, and how the episode ends.

    reward = (distance before - distance after)            [m, straight to the goal]
             + 20             if the goal was reached
             - failure_penalty  if the episode failed (collision, time-out or stuck)

The progress and the +20 are those of the authors' code (ros_jackal, `ShapingRewardWrapper`),
which gives nothing for a failure. Without a penalty, a discount trades success for speed.
"""

import numpy as np

from ses_core.arrays import FloatArray, IntArray
from ses_core.evaluation.outcomes import EpisodeOutcome

SUCCESS_REWARD = 20.0
"""Added when the goal is reached: ros_jackal's `configs/laser.yaml`."""


def rewards(
    distances_before: FloatArray,
    distances_after: FloatArray,
    outcomes: IntArray,
    *,
    failure_penalty: float,
) -> FloatArray:
    """Reward one decision of each of N robots.

    Args:
        distances_before: (N,) [m] to the goal when the parameters were set.
        distances_after: (N,) [m] one decision later.
        outcomes: `EpisodeOutcome` values (N,).
        failure_penalty: Taken off when the episode failed.
    """
    succeeded = outcomes == EpisodeOutcome.SUCCESS
    failed = (outcomes != EpisodeOutcome.SUCCESS) & (outcomes != EpisodeOutcome.RUNNING)
    ending = np.where(succeeded, SUCCESS_REWARD, np.where(failed, -failure_penalty, 0.0))
    return distances_before - distances_after + ending
