"""What SES-PCA, as printed and mended, leaves behind once fitted; drawing needs no scikit-learn."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ses_core.arrays import BoolArray, IntArray
from ses_core.protocols import FittedSynthesizer
from ses_core.synthesis.fixed_order import order_from_arrays, round_the_clusters


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusterDraw:
    """Draws as many from each cluster, by chance.

    Attributes:
        cells: (N, 30, 30) what each environment is given back as.
        clusters: (N,) number of each one's cluster.
    """

    cells: BoolArray
    clusters: IntArray

    @property
    def is_endless(self) -> bool:
        """There are as many as the recorded places give."""
        return False

    def sample(
        self,
        count: int,
        *,
        rng: Generator,
        radius: float | None = None,  # noqa: ARG002  (the seam's: the caller sees to it)
    ) -> BoolArray:
        """Draw from every cluster in turn, without replacement.

        With m clusters the first m x n are n from each; a cluster that runs out is passed
        over. Fewer than `count` where there are no more.
        """
        lots = rng.permutation(len(self.clusters)).astype(np.float64)
        sizes = np.bincount(self.clusters).astype(np.float64)
        return self.cells[round_the_clusters(self.clusters, lots, sizes=sizes)[:count]]

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """Give what rebuilds it."""
        return {"cells": self.cells, "clusters": self.clusters}


def selection_from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> FittedSynthesizer:
    """Rebuild what either fit left: clusters to draw from, or an order that is fixed."""
    if "clusters" not in arrays:
        return order_from_arrays(arrays)
    return ClusterDraw(
        cells=np.asarray(arrays["cells"], dtype=np.bool_),
        clusters=np.asarray(arrays["clusters"], dtype=np.int64),
    )
