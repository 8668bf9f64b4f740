"""Episodes written down by hand."""

from collections.abc import Sequence

from ses_core.evaluation.episodes import Episode, barn_score
from ses_core.evaluation.outcomes import EpisodeOutcome


def episode(
    policy: str,
    world: str,
    outcome: str,
    time: float,
    *,
    pair: int = 0,
    trial: int = 0,
    optimal: float = 5.0,
) -> Episode:
    return Episode(
        episode_id=f"{policy}-{world}-{pair}-{trial}",
        run_id="run",
        policy=policy,
        world_id=world,
        pair=pair,
        trial=trial,
        seed=7,
        outcome=outcome,
        time_s=time,
        path_length_m=10.0,
        optimal_time_s=optimal,
        barn_score=barn_score(EpisodeOutcome[outcome.upper()], time=time, optimal_time=optimal),
        negative_velocity_count=3,
        not_forward_count=5,
        simulator="batch",
        start_x_m=1.0,
        start_y_m=1.5,
        start_yaw_rad=0.0,
        goal_x_m=8.0,
        goal_y_m=1.5,
    )


def successes(policy: str, times: Sequence[float], *, trials: int = 1) -> list[Episode]:
    """Successful episodes, one world per time."""
    return [
        episode(policy, f"world-{number}", "success", time, trial=trial)
        for number, time in enumerate(times)
        for trial in range(trials)
    ]
