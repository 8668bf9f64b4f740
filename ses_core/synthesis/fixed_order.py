"""Environments handed out in a fixed order, and the order that goes round clusters."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ses_core.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedOrder:
    """A fitted synthesizer that leaves nothing to chance; cells: (N, 30, 30), first ones first."""

    cells: BoolArray

    @property
    def is_endless(self) -> bool:
        """There are as many as were recorded."""
        return False

    def sample(
        self,
        count: int,
        *,
        rng: Generator,  # noqa: ARG002  (the seam's: the order is fixed)
        radius: float | None = None,  # noqa: ARG002  (the seam's: the caller sees to it)
    ) -> BoolArray:
        """Give the first ones; fewer than `count` where there are no more."""
        return self.cells[:count].copy()

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """Give what rebuilds it."""
        return {"cells": self.cells}


def order_from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> FixedOrder:
    """Rebuild it from its `arrays()`."""
    return FixedOrder(cells=np.asarray(arrays["cells"], dtype=np.bool_))


def round_the_clusters(clusters: IntArray, keys: FloatArray, *, sizes: FloatArray) -> IntArray:
    """Order members so that every round takes the next one of each cluster, largest first.

    So however few are taken, they stand for as many of the others as so few can. A cluster
    that has run out is passed over; equal keys keep the members' own order.

    Args:
        clusters: (N,) number of each member's cluster.
        keys: (N,) members of a cluster come by rising key.
        sizes: (K,) how much each cluster counts for.

    Returns:
        (N,) the members, in order.
    """
    rank = np.empty(len(sizes), dtype=np.int64)
    rank[np.argsort(-sizes, kind="stable")] = np.arange(len(sizes))
    by_cluster = np.lexsort((keys, rank[clusters]))
    ranks = rank[clusters[by_cluster]]
    turn = np.arange(len(ranks)) - np.searchsorted(ranks, ranks, side="left")
    return by_cluster[np.lexsort((ranks, turn))]
