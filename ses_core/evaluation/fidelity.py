"""How far two simulators tell the same story: agreement of paired trials.

Trials are paired by world, pair, trial and policy; the two sides may differ in the simulator or
in the seed of the noise alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import spearmanr

from ses_core.evaluation.episodes import Episode


@dataclass(frozen=True, slots=True, kw_only=True)
class Fidelity:
    """Agreement of paired trials.

    Attributes:
        trials: Pairs of episodes.
        agreement: Share of pairs with the same outcome.
        kappa: Cohen's kappa of the outcomes; 1 where both sides have but one outcome, the same.
        time_ratio: Mean time of the second side over that of the first, of the pairs in which
            both succeed; nan without such a pair.
        count_correlation: Spearman's correlation of the negative-velocity counts, nan where one
            side's are all alike.
        same_ranking: Whether both sides rank the policies alike by success, then by time.
    """

    trials: int
    agreement: float
    kappa: float
    time_ratio: float
    count_correlation: float
    same_ranking: bool


def fidelity(first: Sequence[Episode], second: Sequence[Episode]) -> Fidelity:
    """Compare two lists of episodes of the same trials.

    Raises:
        ValueError: The lists hold different trials.
    """
    if [_trial(episode) for episode in first] != [_trial(episode) for episode in second]:
        raise ValueError(
            f"found {len(first)} and {len(second)} episodes of different trials, expected the same"
        )
    ours = np.array([episode.outcome for episode in first])
    theirs = np.array([episode.outcome for episode in second])
    both = (ours == "success") & (theirs == "success")
    times = np.array(
        [(one.time_s, other.time_s) for one, other in zip(first, second, strict=True)]
    ).reshape(-1, 2)
    counts = np.array(
        [
            (one.negative_velocity_count, other.negative_velocity_count)
            for one, other in zip(first, second, strict=True)
        ]
    ).reshape(-1, 2)
    is_varied = len(counts) > 1 and bool(np.ptp(counts, axis=0).all())
    return Fidelity(
        trials=len(first),
        agreement=float(np.mean(ours == theirs)),
        kappa=cohen_kappa(ours, theirs),
        time_ratio=float(times[both, 1].mean() / times[both, 0].mean()) if both.any() else np.nan,
        count_correlation=float(spearmanr(*counts.T).statistic) if is_varied else np.nan,
        same_ranking=ranking(first) == ranking(second),
    )


def cohen_kappa(
    first: np.ndarray[tuple[int, ...], np.dtype[np.str_]],
    second: np.ndarray[tuple[int, ...], np.dtype[np.str_]],
) -> float:
    """Give Cohen's kappa of two labellings (N,): agreement beyond what chance would give."""
    labels = np.union1d(first, second)
    by_chance = sum(float(np.mean(first == label) * np.mean(second == label)) for label in labels)
    if by_chance >= 1.0:
        return 1.0
    return (float(np.mean(first == second)) - by_chance) / (1.0 - by_chance)


def ranking(episodes: Sequence[Episode]) -> tuple[str, ...]:
    """Rank policies: more successes first; of equal ones, the quicker successes first."""

    def key(policy: str) -> tuple[float, float]:
        own = [episode for episode in episodes if episode.policy == policy]
        times = [episode.time_s for episode in own if episode.outcome == "success"]
        return -len(times) / len(own), float(np.mean(times)) if times else np.inf

    return tuple(sorted(dict.fromkeys(episode.policy for episode in episodes), key=key))


def _trial(episode: Episode) -> tuple[str, str, int, int]:
    return episode.policy, episode.world_id, episode.pair, episode.trial
