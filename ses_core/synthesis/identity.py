"""Copies of the recorded places, hardest first, as in the paper's physical experiment (IV-E)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ses_core.arrays import BoolArray
from ses_core.navigation import NavigationDomain


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedIdentity:
    """Hands out recorded environments in their order; cells: (N, 30, 30)."""

    cells: BoolArray

    @property
    def is_endless(self) -> bool:
        """There are as many as were recorded."""
        return False

    def sample(
        self,
        count: int,
        *,
        rng: Generator,  # noqa: ARG002  (the seam's: the order is the domain's)
    ) -> BoolArray:
        """Give the first ones; fewer than `count` where there are no more."""
        return self.cells[:count].copy()

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """Give what rebuilds it."""
        return {"cells": self.cells}


@dataclass(frozen=True, slots=True)
class Identity:
    """Learns nothing: it keeps the environments in their order."""

    def fit(
        self,
        domain: NavigationDomain,
        *,
        rng: Generator,  # noqa: ARG002  (the seam's: nothing is drawn here)
        progress: Callable[[float], None],
    ) -> FittedIdentity:
        """Keep the domain's cells."""
        progress(1.0)
        return FittedIdentity(cells=domain.cells())
