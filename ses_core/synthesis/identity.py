"""Copies of the recorded places, hardest first, as in the paper's physical experiment (IV-E)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ses_core.navigation import NavigationDomain
from ses_core.protocols import FittedSynthesizer
from ses_core.synthesis.fixed_order import FixedOrder, order_from_arrays


@dataclass(frozen=True, slots=True)
class Identity:
    """Learns nothing: it keeps the environments in their order."""

    def fit(
        self,
        domain: NavigationDomain,
        *,
        rng: Generator,  # noqa: ARG002  (the seam's: nothing is drawn here)
        progress: Callable[[float], None],
        start: FittedSynthesizer | None = None,  # noqa: ARG002  (the seam's: nothing is learned)
    ) -> FixedOrder:
        """Keep the domain's cells."""
        progress(1.0)
        return FixedOrder(cells=domain.cells())


def identity_from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> FixedOrder:
    """Rebuild a fit from its `arrays()`."""
    return order_from_arrays(arrays)
