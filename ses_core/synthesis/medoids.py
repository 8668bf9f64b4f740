"""k-medoids: the recorded environments from which all others are least far away.

A control that the paper lacks: no component and no centre stands between, distance is the
number of cells in which two environments differ.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ses_core.arrays import BoolArray
from ses_core.navigation import NavigationDomain
from ses_core.protocols import FittedSynthesizer
from ses_core.scorecard.distances import differing_cells, distinct_maps
from ses_core.synthesis.fixed_order import FixedOrder, round_the_clusters
from ses_core.synthesis.k_medoids import Int16Array, k_medoids

_BLOCK = 512
"""Rows of the distance matrix that are counted at once, to bound what is held in single floats."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Medoids:
    """Finds k-medoids; a place recorded more than once is one point that counts more.

    The distances take 2 bytes for every pair of different environments.

    Attributes:
        environments: M, the number of medoids.
    """

    environments: int

    def fit(
        self,
        domain: NavigationDomain,
        *,
        rng: Generator,
        progress: Callable[[float], None],
        start: FittedSynthesizer | None = None,  # noqa: ARG002  (the seam's: always found anew)
    ) -> FixedOrder:
        """Order the environments: medoids, the largest cluster's first, then whom they stand for.

        After the medoids comes the nearest other one to each, and so on.
        """
        maps = distinct_maps(domain.cells())
        weights = np.bincount(maps.index).astype(np.int64)
        distances = _distance_matrix(maps.cells)
        found = k_medoids(distances, weights, count=self.environments, rng=rng, progress=progress)
        apart = distances[found.medoids[found.nearest], np.arange(len(weights))]
        order = round_the_clusters(
            found.nearest,
            apart.astype(np.float64),
            sizes=np.bincount(found.nearest, weights=weights).astype(np.float64),
        )
        return FixedOrder(cells=maps.cells[order])


def _distance_matrix(cells: BoolArray) -> Int16Array:
    """Count the cells (N, N) in which environments (N, 30, 30) differ from one another."""
    distances = np.empty((len(cells), len(cells)), dtype=np.int16)
    for first in range(0, len(cells), _BLOCK):
        distances[first : first + _BLOCK] = differing_cells(cells[first : first + _BLOCK], cells)
    return distances
