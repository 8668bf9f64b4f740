"""MMD^2, the distance between two samples in the eyes of a kernel, and what chance would give."""

import numpy as np
from numpy.random import Generator

from ses_core.arrays import Float32Array, FloatArray, IntArray

_ROUNDING = 1e-12
"""Shuffles this near to the observed value count as equal to it."""


def median_bandwidth(distances: Float32Array, sample: IntArray) -> float:
    """Give the median distance between different maps of a sample: the usual bandwidth.

    1 where there are no two different ones: any kernel then says the same.
    """
    different = np.unique(sample)
    above = distances[np.ix_(different, different)][np.triu_indices(len(different), 1)]
    return float(np.median(above)) if len(above) else 1.0


def gaussian_kernel(distances: Float32Array, bandwidth: float) -> FloatArray:
    """Give exp(-d^2 / (2 bandwidth^2)) of distances (U, U)."""
    return np.exp(-(distances.astype(np.float64) ** 2) / (2.0 * bandwidth**2))


def mmd_squared(kernel: FloatArray, first: IntArray, second: IntArray) -> float:
    """Give the unbiased estimate of MMD^2 (Gretton et al. 2012, equation 3); may be below 0.

    Args:
        kernel: (U, U) between distinct maps.
        first: (N,) indices of a sample's maps, N >= 2.
        second: (M,) indices of the other sample's maps, M >= 2.
    """
    pooled, is_first = _pooled(kernel, first, second)
    return float(_mmd_of_labels(pooled, is_first[:, None])[0])


def permutation_p_value(
    kernel: FloatArray,
    first: IntArray,
    second: IntArray,
    *,
    permutations: int,
    rng: Generator,
) -> float:
    """Give the share of shuffles whose MMD^2 is no smaller, the observed one counted among them.

    It takes environments for exchangeable; those of one site resemble each other, so two halves
    of different sites come out below 1/2 as well: compare with the real-against-real value.
    """
    pooled, is_first = _pooled(kernel, first, second)
    labels = np.stack([is_first, *(rng.permutation(is_first) for _ in range(permutations))], axis=1)
    values = _mmd_of_labels(pooled, labels)
    return float((values >= values[0] - _ROUNDING).mean())


def _pooled(kernel: FloatArray, first: IntArray, second: IntArray) -> tuple[FloatArray, FloatArray]:
    """Give the kernel between all of both samples, 0 of each with itself, and who is of which."""
    both = np.concatenate((first, second))
    pooled = kernel[np.ix_(both, both)]
    np.fill_diagonal(pooled, 0.0)
    return pooled, (np.arange(len(both)) < len(first)).astype(np.float64)


def _mmd_of_labels(pooled: FloatArray, is_first: FloatArray) -> FloatArray:
    """Give MMD^2 (P,) for columns of labels (N + M, P), 1 = of the first sample."""
    n = float(is_first[:, 0].sum())
    m = float(len(is_first)) - n
    to_first = pooled @ is_first
    within_first = (is_first * to_first).sum(axis=0)
    across = to_first.sum(axis=0) - within_first
    within_second = pooled.sum() - within_first - 2.0 * across
    return within_first / (n * (n - 1)) + within_second / (m * (m - 1)) - 2.0 * across / (n * m)
