"""SES-PCA as printed: n reconstructions from each of m clusters (section III-C)."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from numpy.random import Generator

from ses_core.navigation import NavigationDomain
from ses_core.protocols import FittedSynthesizer
from ses_core.synthesis.pca_selection import ClusterDraw
from ses_core.synthesis.principal_clusters import find_clusters
from ses_core.synthesis_settings import PcaPaperSettings


@dataclass(frozen=True, slots=True)
class PcaPaper:
    """Clusters environments in the space of their components, and gives back what these keep.

    The paper selects M = m x n and names neither; it does not say how a reconstruction is
    made binary again.

    Attributes:
        settings: n and what else the paper leaves open.
        environments: M; the clusters are m = M / n, rounded up.
    """

    settings: PcaPaperSettings
    environments: int

    def fit(
        self,
        domain: NavigationDomain,
        *,
        rng: Generator,
        progress: Callable[[float], None],
        start: FittedSynthesizer | None = None,  # noqa: ARG002  (the seam's: always found anew)
    ) -> ClusterDraw:
        """Find the clusters and reconstruct every environment."""
        found = find_clusters(
            domain.cells(),
            components=self.settings.components,
            clusters=math.ceil(self.environments / self.settings.per_cluster),
            rng=rng,
            progress=progress,
        )
        return ClusterDraw(
            cells=found.reconstructions(threshold=self.settings.threshold),
            clusters=found.clusters,
        )
