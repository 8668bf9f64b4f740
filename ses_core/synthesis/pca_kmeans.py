"""SES-PCA: principal components, K-means in their space, reconstruction (section III-C)."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from sklearn.cluster import KMeans
from sklearn.decomposition import PCA
from sklearn.exceptions import ConvergenceWarning
from threadpoolctl import threadpool_limits

from ses_core.arrays import BoolArray, FloatArray, IntArray
from ses_core.navigation import NavigationDomain
from ses_core.occupancy import ENVIRONMENT_CELLS

RECONSTRUCTION_THRESHOLD = 0.5
"""Half way between free (0) and occupied (1); the paper does not say how it binarises."""

KMEANS_STARTS = 4
"""K-means is run from this many seedings and the tightest clusters are kept."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedPcaKmeans:
    """Environments in the space of their principal components, by cluster.

    Attributes:
        mean: (900,) share of environments in which a cell is occupied.
        components: (C, 900) principal components.
        coordinates: (N, C) environments in their space.
        clusters: (N,) number of each one's cluster.
    """

    mean: FloatArray
    components: FloatArray
    coordinates: FloatArray
    clusters: IntArray

    @property
    def is_endless(self) -> bool:
        """There are as many as were recorded."""
        return False

    def sample(self, count: int, *, rng: Generator) -> BoolArray:
        """Draw from every cluster in turn, without replacement, and reconstruct.

        With m clusters the first m x n are n from each; a cluster that runs out is passed
        over. Fewer than `count` where there are no more.
        """
        shuffled = rng.permutation(len(self.clusters))
        turn_in_cluster = _occurrence(self.clusters[shuffled])
        by_turn = np.lexsort((self.clusters[shuffled], turn_in_cluster))
        return self._reconstruct(self.coordinates[shuffled[by_turn[:count]]])

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """Give what rebuilds it."""
        return {
            "mean": self.mean,
            "components": self.components,
            "coordinates": self.coordinates,
            "clusters": self.clusters,
        }

    def _reconstruct(self, coordinates: FloatArray) -> BoolArray:
        images = coordinates @ self.components + self.mean
        side = ENVIRONMENT_CELLS
        return (images > RECONSTRUCTION_THRESHOLD).reshape(len(images), side, side)


@dataclass(frozen=True, slots=True, kw_only=True)
class PcaKmeans:
    """Finds principal components, then clusters environments in their space.

    Attributes:
        components: Principal components kept; fewer than there are environments.
        clusters: m; at most one for each environment.
    """

    components: int
    clusters: int

    def fit(
        self, domain: NavigationDomain, *, rng: Generator, progress: Callable[[float], None]
    ) -> FittedPcaKmeans:
        """Fit both, on one thread so that equal seeds give equal clusters."""
        flat = domain.cells().reshape(len(domain.environments), -1).astype(np.float64)
        seed = int(rng.integers(2**31))
        with threadpool_limits(1):
            pca = PCA(self.components, svd_solver="full")
            coordinates = pca.fit_transform(flat)
            progress(0.5)
            kmeans = KMeans(min(self.clusters, len(flat)), n_init=KMEANS_STARTS, random_state=seed)
            with warnings.catch_warnings():
                # Fewer distinct environments than clusters: the clusters left empty do no harm.
                warnings.simplefilter("ignore", ConvergenceWarning)
                clusters = kmeans.fit_predict(coordinates)
        progress(1.0)
        return FittedPcaKmeans(
            mean=pca.mean_,
            components=pca.components_,
            coordinates=coordinates,
            clusters=clusters.astype(np.int64),
        )


def _occurrence(labels: IntArray) -> IntArray:
    """Number equal labels (N,) in the order they appear: [5, 5, 2, 5] -> [0, 1, 0, 2]."""
    order = np.argsort(labels, kind="stable")
    ordered = labels[order]
    starts = np.searchsorted(ordered, ordered, side="left")
    occurrence = np.empty_like(labels)
    occurrence[order] = np.arange(len(labels)) - starts
    return occurrence
