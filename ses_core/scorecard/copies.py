"""Copies: environments nearly equal to one another, or to one that was learned from."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ses_core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from ses_core.scorecard.distances import nearest
from ses_core.scorecard.halving import Grouping

_RESAMPLES = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class Memorisation:
    """Are synthesized environments nearer to the training ones than fresh real ones are.

    Attributes:
        nearer: Chance that a synthesized one is nearer than a real one (ties half): 1/2 where
            neither is, 1 where all are copies.
        interval: Its 95 % interval, by resampling environments.
        p_value: One-sided, of Mann and Whitney's test.
        synthesized: (M,) cells by which each differs from the nearest training environment.
        real: (N,) the same of each real one, its own group left out.
    """

    nearer: float
    interval: tuple[float, float]
    p_value: float
    synthesized: FloatArray
    real: FloatArray


def near_duplicate_share(apart: Float32Array, sample: IntArray, *, cells: float) -> float:
    """Give the share of a sample with another of it no more than so many cells away.

    Args:
        apart: (U, U) differing cells between distinct maps, mirrored or not.
        sample: (N,) indices of its maps.
        cells: Most differing cells.
    """
    among = apart[np.ix_(sample, sample)].copy()
    np.fill_diagonal(among, np.inf)
    return float((among.min(axis=1) <= cells).mean())


def nearest_training(cells: BoolArray, training: BoolArray, *, mirrored_too: bool) -> FloatArray:
    """Count the cells (M,) in which environments differ from the nearest training one."""
    return nearest(
        cells,
        training,
        left_out=np.full(len(cells), -1),
        groups=np.zeros(len(training), dtype=np.int64),
        mirrored_too=mirrored_too,
    )


def nearest_of_other_groups(
    training: BoolArray, grouping: Grouping, *, mirrored_too: bool
) -> FloatArray:
    """Count the cells (N,) in which real environments differ from the nearest of other groups."""
    return nearest(
        training,
        training,
        left_out=grouping.labels,
        groups=grouping.labels,
        mirrored_too=mirrored_too,
    )


def memorisation(
    cells: BoolArray,
    training: BoolArray,
    grouping: Grouping,
    *,
    mirrored_too: bool,
    rng: Generator,
) -> Memorisation:
    """Test whether environments are nearer to the training ones than fresh real ones are.

    A real environment is compared with all groups but its own. So that a synthesized one has no
    more to be near to, it is compared with all groups but one, drawn by size.

    Args:
        cells: (M, 30, 30) synthesized environments, M >= 1.
        training: (N, 30, 30) real ones, of two groups or more.
        grouping: Of the real ones.
        mirrored_too: Mirror images count as well.
        rng: Source of chance.
    """
    synthesized = nearest(
        cells,
        training,
        left_out=rng.choice(grouping.labels, len(cells)),
        groups=grouping.labels,
        mirrored_too=mirrored_too,
    )
    real = nearest_of_other_groups(training, grouping, mirrored_too=mirrored_too)
    return _compared(synthesized, real, rng)


def memorisation_beside_heldout(
    cells: BoolArray,
    training: BoolArray,
    heldout: BoolArray,
    *,
    mirrored_too: bool,
    rng: Generator,
) -> Memorisation:
    """Test whether environments are nearer to the training ones than held-out real ones are.

    Args:
        cells: (M, 30, 30) synthesized environments, M >= 1.
        training: (T, 30, 30) real ones that were learned from.
        heldout: (N, 30, 30) real ones of other sites, N >= 1.
        mirrored_too: Mirror images count as well.
        rng: Source of chance.
    """
    return _compared(
        nearest_training(cells, training, mirrored_too=mirrored_too),
        nearest_training(heldout, training, mirrored_too=mirrored_too),
        rng,
    )


def _compared(synthesized: FloatArray, real: FloatArray, rng: Generator) -> Memorisation:
    """Compare the distances (M,) of synthesized ones with those (N,) of real ones."""
    # scipy.stats takes half a second to import: flows that only name a task need not wait for it.
    from scipy.stats import mannwhitneyu

    test = mannwhitneyu(synthesized, real, alternative="less")
    resampled = [
        chance_nearer(rng.choice(synthesized, len(synthesized)), rng.choice(real, len(real)))
        for _ in range(_RESAMPLES)
    ]
    low, high = np.quantile(resampled, (0.025, 0.975))
    return Memorisation(
        nearer=chance_nearer(synthesized, real),
        interval=(float(low), float(high)),
        p_value=float(test.pvalue),
        synthesized=synthesized,
        real=real,
    )


def chance_nearer(first: FloatArray, second: FloatArray) -> float:
    """Give the chance that one of the first is less than one of the second, ties half."""
    order = np.sort(second)
    below = np.searchsorted(order, first, side="left")
    up_to = np.searchsorted(order, first, side="right")
    return float((len(second) - 0.5 * (below + up_to)).mean() / len(second))
