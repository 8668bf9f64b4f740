"""Arms of an experiment: policies trained alike but for the seed, compared over worlds and seeds.

A difference between two trainings is a difference between two draws of a seed, and worlds are
a sample too: both are resampled (the two-way, or pigeonhole, bootstrap: Owen, "The pigeonhole
bootstrap", Annals of Applied Statistics 1 (2007) 386, which errs on the wide side).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.evaluation.episodes import Episode
from ses_core.evaluation.statistics import Interval, restricted_time

_RESAMPLES = 10_000

_POWER_QUANTILES = 1.959964 + 0.841621
"""Of a two-sided test at 5 % with 80 % power."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmComparison:
    """Ours minus theirs, averaged over the seeds of both, over the trials that all have driven.

    Attributes:
        success_difference: As a fraction.
        ci: 95 % interval over worlds and seeds, as are the others.
        time_difference_s: Of the mean time with failures counted as 100 s.
        time_deviation_s: Standard deviation between worlds of that difference; it says how many
            worlds a smaller interval takes.
        trials: Of each policy.
    """

    success_difference: float
    ci: Interval
    time_difference_s: float
    ci_s: Interval
    time_deviation_s: float
    our_seeds: int
    their_seeds: int
    worlds: int
    trials: int


def compare_arms(
    episodes: Sequence[Episode], ours: Sequence[str], theirs: Sequence[str], *, seed: int = 0
) -> ArmComparison:
    """Compare two arms, each given by the names of its policies, one per training seed.

    Raises:
        ValueError: A policy has not driven the same trials as the first, or in fewer than two
            worlds.
    """
    names = [*dict.fromkeys([*ours, *theirs])]
    worlds, counts, success, times = _sums(episodes, names)
    if len(worlds) < 2:
        raise ValueError(f"{len(worlds)} worlds were driven in, expected at least 2")
    own, other = [names.index(one) for one in ours], [names.index(one) for one in theirs]
    rng = np.random.default_rng(seed)
    weights = rng.multinomial(len(worlds), np.full(len(worlds), 1 / len(worlds)), size=_RESAMPLES)
    drawn = _drawn_shares(own, len(names), rng) - _drawn_shares(other, len(names), rng)
    every = np.zeros(len(names))
    every[own] += 1 / len(own)
    every[other] -= 1 / len(other)

    def interval(sums: FloatArray) -> Interval:
        differences = np.einsum("rp,pw,rw->r", drawn, sums, weights, optimize=True)
        low, high = np.quantile(differences / (weights @ counts), (0.025, 0.975))
        return float(low), float(high)

    return ArmComparison(
        success_difference=float(every @ success.sum(axis=1) / counts.sum()),
        ci=interval(success),
        time_difference_s=float(every @ times.sum(axis=1) / counts.sum()),
        ci_s=interval(times),
        time_deviation_s=float(np.std(every @ times / counts, ddof=1)),
        our_seeds=len(own),
        their_seeds=len(other),
        worlds=len(worlds),
        trials=int(counts.sum()),
    )


def worlds_needed(deviation: float, difference: float) -> int:
    """Give the worlds that would show a difference at 80 % power in a two-sided test at 5 %.

    ((1.96 + 0.84) deviation / difference)^2, the normal approximation for paired means.

    Args:
        deviation: Between worlds, of the paired difference.
        difference: To be shown, in the same unit.
    """
    return int(np.ceil((_POWER_QUANTILES * deviation / difference) ** 2))


def _sums(
    episodes: Sequence[Episode], names: Sequence[str]
) -> tuple[list[str], FloatArray, FloatArray, FloatArray]:
    """Sum by policy and world: worlds (W), trials (W,), successes and times (P, W)."""
    driven = {
        name: {
            (one.world_id, one.pair, one.trial, one.seed): one
            for one in episodes
            if one.policy == name
        }
        for name in names
    }
    shared = driven[names[0]].keys()
    for name in names:
        if driven[name].keys() != shared:
            raise ValueError(
                f"{name} and {names[0]} share {len(driven[name].keys() & shared)} trials, "
                f"expected all of {len(driven[name])} and {len(shared)}"
            )
    worlds = sorted({trial[0] for trial in shared})
    place = {world: number for number, world in enumerate(worlds)}
    counts = np.zeros(len(worlds))
    success, times = np.zeros((len(names), len(worlds))), np.zeros((len(names), len(worlds)))
    for trial in shared:
        column = place[trial[0]]
        counts[column] += 1
        for row, name in enumerate(names):
            success[row, column] += driven[name][trial].outcome == "success"
            times[row, column] += restricted_time(driven[name][trial])
    return worlds, counts, success, times


def _drawn_shares(members: Sequence[int], count: int, rng: np.random.Generator) -> FloatArray:
    """Draw an arm's policies with replacement: their shares (resamples, count)."""
    shares = np.zeros((_RESAMPLES, count))
    draws = rng.multinomial(len(members), np.full(len(members), 1 / len(members)), size=_RESAMPLES)
    shares[:, members] = draws / len(members)
    return shares
