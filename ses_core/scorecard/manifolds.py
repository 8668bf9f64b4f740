"""Precision, recall, density and coverage: do two samples lie in each other's neighbourhoods.

Kynkäänniemi et al. 2019 and Naeem et al. 2020, with two changes that binary maps need. A
sample on the edge of a ball is inside it (`<=`, where the reference code has `<`): distances
between maps are whole numbers and tie. And a radius reaches to the k-th nearest *different*
map, so that copies do not shrink it to nothing.
"""

from dataclasses import dataclass

import numpy as np

from ses_core.arrays import Float32Array, FloatArray, IntArray


@dataclass(frozen=True, slots=True, kw_only=True)
class ManifoldScores:
    """How two samples cover each other, each from 0 to 1 but density, which has no bound.

    Attributes:
        precision: Share of the synthesized inside the ball of some real one.
        recall: Share of the real inside the ball of some synthesized one.
        density: Real balls that hold a synthesized one, on average, over k.
        coverage: Share of the real whose own ball holds a synthesized one.
    """

    precision: float
    recall: float
    density: float
    coverage: float


def manifold_scores(
    distances: Float32Array, real: IntArray, synthesized: IntArray, *, k: int
) -> ManifoldScores | None:
    """Compare two samples.

    A synthesized sample of k maps or fewer has balls that reach to the farthest of them: a
    generator that always makes the same map gets its poor recall, not an excuse.

    Args:
        distances: (U, U) between distinct maps, 0 to itself alone.
        real: (N,) indices of the real sample's maps.
        synthesized: (M,) indices of the synthesized sample's maps.
        k: Which nearest neighbour a ball reaches to.

    Returns:
        None with k different real maps or fewer, or without a synthesized one.
    """
    different, first = np.unique(real, return_index=True)
    if len(different) <= k or len(synthesized) == 0:
        return None
    real_radii, synthesized_radii = _radii(distances, real, k), _radii(distances, synthesized, k)
    between = distances[np.ix_(synthesized, real)]
    is_in_real = between <= real_radii[None, :]
    is_in_synthesized = between <= synthesized_radii[:, None]
    return ManifoldScores(
        precision=float(is_in_real.any(axis=1).mean()),
        recall=float(is_in_synthesized.any(axis=0).mean()),
        density=float(is_in_real[:, first].sum(axis=1).mean() / k),
        coverage=float(is_in_real.any(axis=0).mean()),
    )


def _radii(distances: Float32Array, sample: IntArray, k: int) -> FloatArray:
    """Distance (N,) of each of a sample to its k-th nearest different map."""
    different, position = np.unique(sample, return_inverse=True)
    kth = min(k, len(different) - 1)
    among = distances[np.ix_(different, different)]
    radii = np.partition(among, kth, axis=1)[:, kth]
    return radii[position].astype(np.float64)
