"""K-means in the space of principal components (section III-C); what both SES-PCA share."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from sklearn.cluster import KMeans
from sklearn.decomposition import PCA
from sklearn.exceptions import ConvergenceWarning
from threadpoolctl import threadpool_limits

from ses_core.arrays import BoolArray, FloatArray, IntArray
from ses_core.occupancy import ENVIRONMENT_CELLS

KMEANS_STARTS = 4
"""K-means is run from this many seedings and the tightest clusters are kept."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PrincipalClusters:
    """Environments in the space of their principal components, in clusters.

    Attributes:
        mean: (900,) share of environments in which a cell is occupied.
        components: (C, 900) principal components, orthonormal.
        coordinates: (N, C) environments in their space.
        clusters: (N,) number of each one's cluster.
        centres: (m, C) centres of the clusters.
    """

    mean: FloatArray
    components: FloatArray
    coordinates: FloatArray
    clusters: IntArray
    centres: FloatArray

    def reconstructions(self, *, threshold: float) -> BoolArray:
        """Give environments (N, 30, 30) back from their components; above is occupied."""
        images = self.coordinates @ self.components + self.mean
        return (images > threshold).reshape(-1, ENVIRONMENT_CELLS, ENVIRONMENT_CELLS)

    def distances(self) -> FloatArray:
        """Euclidean distance (N,) of every environment to the centre of its cluster."""
        apart: FloatArray = np.linalg.norm(self.coordinates - self.centres[self.clusters], axis=1)
        return apart

    def sizes(self) -> FloatArray:
        """Count the environments (m,) in every cluster."""
        return np.bincount(self.clusters, minlength=len(self.centres)).astype(np.float64)


def find_clusters(
    cells: BoolArray,
    *,
    components: int,
    clusters: int,
    rng: Generator,
    progress: Callable[[float], None],
) -> PrincipalClusters:
    """Find components and clusters, on one thread so that equal seeds give equal clusters.

    Args:
        cells: (N, 30, 30) environments.
        components: C; at most N and at most 900.
        clusters: m; at most one for each environment.
        rng: Source of chance.
        progress: Hears the share that is done, from 0 to 1.
    """
    flat = cells.reshape(len(cells), -1).astype(np.float64)
    seed = int(rng.integers(2**31))
    with threadpool_limits(1):
        pca = PCA(components, svd_solver="full")
        with np.errstate(invalid="ignore"):
            # Equal environments have no variance of which a component could explain a share.
            coordinates = pca.fit_transform(flat)
        progress(0.5)
        kmeans = KMeans(min(clusters, len(flat)), n_init=KMEANS_STARTS, random_state=seed)
        with warnings.catch_warnings():
            # Fewer distinct environments than clusters: the clusters left empty do no harm.
            warnings.simplefilter("ignore", ConvergenceWarning)
            labels = kmeans.fit_predict(coordinates)
    progress(1.0)
    return PrincipalClusters(
        mean=pca.mean_,
        components=pca.components_,
        coordinates=coordinates,
        clusters=labels.astype(np.int64),
        centres=kmeans.cluster_centers_,
    )
