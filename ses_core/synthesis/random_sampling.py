"""SES-RS: the uniform distribution over the challenging environments (section III-C)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ses_core.arrays import BoolArray


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedRandomSampling:
    """Draws recorded environments; cells: (N, 30, 30)."""

    cells: BoolArray

    @property
    def is_endless(self) -> bool:
        """There are as many as were recorded."""
        return False

    def sample(
        self,
        count: int,
        *,
        rng: Generator,
        radius: float | None = None,  # noqa: ARG002  (the seam's: the caller sees to it)
    ) -> BoolArray:
        """Draw without replacement; fewer than `count` where there are no more."""
        return self.cells[rng.permutation(len(self.cells))[:count]]

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """Give what rebuilds it."""
        return {"cells": self.cells}
