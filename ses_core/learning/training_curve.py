"""The learning curve: what episodes were like while a policy trained."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvePoint:
    """Episodes that ended in one stretch of training.

    Attributes:
        steps: Decisions made when the stretch ended.
        episodes: Episodes that ended within it.
        mean_return: Undiscounted reward per episode.
        mean_time_s: Mean time of the successes; None without one.
    """

    steps: int
    episodes: int
    mean_return: float
    success_rate: float
    collision_rate: float
    mean_time_s: float | None
