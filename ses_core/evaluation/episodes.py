"""`Episode`: one trial of a policy, and BARN's score for it."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

from ses_core.evaluation.outcomes import EpisodeOutcome

BARN_SPEED_MPS = 2.0
"""Speed at which the optimal path is taken to be driven (the-barn-challenge, `run.py`)."""

BARN_FASTEST, BARN_SLOWEST = 2.0, 8.0
"""Times are clipped to these multiples of the optimal time: BARN since 2023; 4 and 8 in 2022."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """One trial; the fields are the columns of the table `episodes`.

    With its world and policy, seed, start and goal are enough to drive it again.
    """

    episode_id: str
    run_id: str
    policy: str
    world_id: str
    pair: int
    trial: int
    seed: int
    outcome: str
    time_s: float
    path_length_m: float
    optimal_time_s: float
    barn_score: float
    negative_velocity_count: int
    not_forward_count: int
    simulator: str
    start_x_m: float
    start_y_m: float
    start_yaw_rad: float
    goal_x_m: float
    goal_y_m: float


def barn_score(outcome: EpisodeOutcome, *, time: float, optimal_time: float) -> float:
    """Score an episode as the BARN challenge does: 0 for a failure, at most 1/2 for a success.

    optimal time / clip(time, 2 x optimal time, 8 x optimal time)
    """
    if outcome != EpisodeOutcome.SUCCESS:
        return 0.0
    return optimal_time / min(max(time, BARN_FASTEST * optimal_time), BARN_SLOWEST * optimal_time)


def episode_columns(episodes: Sequence[Episode]) -> dict[str, list[str | int | float]]:
    """Lay episodes out as the columns of the table `episodes`."""
    return {
        column.name: [getattr(episode, column.name) for episode in episodes]
        for column in fields(Episode)
    }
