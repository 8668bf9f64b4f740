"""SES-PCA, mended: what stands for a cluster is nearest to its centre, and real.

The paper draws any n environments of a cluster (section III-C), an outlier as likely as what
lies in the middle, and trains in reconstructions, which lose the cells that few places have.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ses_core.navigation import NavigationDomain
from ses_core.protocols import FittedSynthesizer
from ses_core.scorecard.distances import distinct_maps
from ses_core.synthesis.fixed_order import FixedOrder, round_the_clusters
from ses_core.synthesis.principal_clusters import find_clusters
from ses_core.synthesis_settings import PcaSettings

RECONSTRUCTION_THRESHOLD = 0.5
"""Half way between free (0) and occupied (1)."""

_DECIMALS = 9
"""Of distances. Both members of a pair are as far from its centre: rounding must not choose."""


@dataclass(frozen=True, slots=True)
class PcaKmeans:
    """Clusters environments in the space of their components, and takes the most central.

    Attributes:
        settings: How many stand for a cluster, and what is given.
        environments: M; the clusters are m = M / n, rounded up.
    """

    settings: PcaSettings
    environments: int

    def fit(
        self,
        domain: NavigationDomain,
        *,
        rng: Generator,
        progress: Callable[[float], None],
        start: FittedSynthesizer | None = None,  # noqa: ARG002  (the seam's: always found anew)
    ) -> FixedOrder:
        """Order the environments: the most central of every cluster, then the next ones.

        The first m x n are n of each cluster, the largest cluster's first in every round.
        Equal ones come once.
        """
        recorded = domain.cells()
        found = find_clusters(
            recorded,
            components=self.settings.components,
            clusters=math.ceil(self.environments / self.settings.per_cluster),
            rng=rng,
            progress=progress,
        )
        given = recorded
        if self.settings.gives == "reconstruction":
            given = found.reconstructions(threshold=RECONSTRUCTION_THRESHOLD)
        apart = found.distances().round(_DECIMALS)
        central = np.argsort(apart, kind="stable")
        _, first = np.unique(distinct_maps(given[central]).index, return_index=True)
        # Of equal ones the most central; among equally central ones the hardest first.
        chosen = np.sort(central[first])
        order = round_the_clusters(found.clusters[chosen], apart[chosen], sizes=found.sizes())
        return FixedOrder(cells=given[chosen[order]])
