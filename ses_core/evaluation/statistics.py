"""What episodes amount to: rates, times and BARN's score, with intervals clustered by world.

Trials in one world resemble each other (intra-class correlation near 0.4 on BARN's public
logs), so worlds are resampled, never trials: repeats in few worlds do not narrow an interval.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.evaluation.episodes import Episode

TIME_CAP_S = 100.0
"""A failure counts as this long in the restricted mean time [s]."""

Interval = tuple[float, float]

_RESAMPLES = 10_000
_NORMAL_QUANTILE = 1.959964
"""Of the two-sided 95 % interval."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicySummary:
    """One policy's row: Table I's columns with what the paper leaves out.

    Attributes:
        success_ci: 95 % interval; None with fewer than two worlds, as are the others.
        mean_time_s: Mean time of the successes, as in the paper; None without a success.
        restricted_mean_time_s: Mean time with every failure counted as 100 s.
        trials: Number of episodes.
    """

    policy: str
    success_rate: float
    success_ci: Interval | None
    mean_time_s: float | None
    mean_time_ci_s: Interval | None
    restricted_mean_time_s: float
    restricted_mean_time_ci_s: Interval | None
    collision_rate: float
    timeout_rate: float
    stuck_rate: float
    barn_score: float
    barn_score_ci: Interval | None
    trials: int
    worlds: int


def summarize(episodes: Sequence[Episode], *, seed: int = 0) -> list[PolicySummary]:
    """Summarize episodes by policy, in the order in which the policies first appear."""
    names = dict.fromkeys(episode.policy for episode in episodes)
    return [
        _summary(name, [episode for episode in episodes if episode.policy == name], seed=seed)
        for name in names
    ]


def restricted_time(episode: Episode) -> float:
    """Time of an episode [s], where a failure counts as the cap."""
    return min(episode.time_s, TIME_CAP_S) if episode.outcome == "success" else TIME_CAP_S


def ratio_interval(
    numerators: FloatArray,
    denominators: FloatArray,
    clusters: Sequence[str],
    *,
    seed: int,
    resamples: int = _RESAMPLES,
) -> Interval | None:
    """Give the 95 % percentile interval of sum(numerators) / sum(denominators).

    Whole clusters are drawn with replacement.

    Args:
        numerators: (E,) one per episode.
        denominators: (E,) one per episode; zeros leave an episode out.
        clusters: The world of each episode (E,).
        seed: Seed of the draws: equal input, equal interval.
        resamples: Number of draws.

    Returns:
        None with fewer than two clusters, or where a draw can have nothing to divide by.
    """
    names, cluster = np.unique(np.asarray(clusters, dtype=np.str_), return_inverse=True)
    if len(names) < 2:
        return None
    above = np.bincount(cluster, weights=numerators, minlength=len(names))
    below = np.bincount(cluster, weights=denominators, minlength=len(names))
    # A cluster without a denominator (a world without a success) says nothing about a ratio.
    above, below = above[below > 0], below[below > 0]
    if len(below) < 2:
        return None
    rng = np.random.default_rng(seed)
    draws = rng.multinomial(len(below), np.full(len(below), 1 / len(below)), size=resamples)
    low, high = np.quantile((draws @ above) / (draws @ below), (0.025, 0.975))
    return float(low), float(high)


def rate_interval(
    hits: FloatArray, clusters: Sequence[str], *, seed: int, resamples: int = _RESAMPLES
) -> Interval | None:
    """Give the 95 % interval of a share of episodes.

    Where every episode went the same way, resampling says nothing: Wilson's interval with the
    number of worlds for a sample size stands in.
    """
    interval = ratio_interval(hits, np.ones(len(hits)), clusters, seed=seed, resamples=resamples)
    share = float(hits.mean())
    if interval is None or 0.0 < share < 1.0:
        return interval
    beyond = _NORMAL_QUANTILE**2 / (len(set(clusters)) + _NORMAL_QUANTILE**2)
    return (0.0, beyond) if share == 0.0 else (1.0 - beyond, 1.0)


def _summary(name: str, episodes: Sequence[Episode], *, seed: int) -> PolicySummary:
    worlds = [episode.world_id for episode in episodes]
    outcomes = np.array([episode.outcome for episode in episodes])
    success = (outcomes == "success").astype(np.float64)
    times = np.array([episode.time_s for episode in episodes])
    restricted = np.array([restricted_time(episode) for episode in episodes])
    scores = np.array([episode.barn_score for episode in episodes])
    every = np.ones(len(episodes))
    return PolicySummary(
        policy=name,
        success_rate=float(success.mean()),
        success_ci=rate_interval(success, worlds, seed=seed),
        mean_time_s=float(times[success > 0].mean()) if success.any() else None,
        mean_time_ci_s=ratio_interval(times * success, success, worlds, seed=seed),
        restricted_mean_time_s=float(restricted.mean()),
        restricted_mean_time_ci_s=ratio_interval(restricted, every, worlds, seed=seed),
        collision_rate=float((outcomes == "collision").mean()),
        timeout_rate=float((outcomes == "timeout").mean()),
        stuck_rate=float((outcomes == "stuck").mean()),
        barn_score=float(scores.mean()),
        barn_score_ci=ratio_interval(scores, every, worlds, seed=seed),
        trials=len(episodes),
        worlds=len(set(worlds)),
    )
