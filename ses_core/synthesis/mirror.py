"""Mirror images and the way back: four courses from every recorded place.

Row 0 of the cells is the edge of the goal and column 0 the left edge; the start lies in the
middle of the last row. So columns reversed are the place seen in a mirror, and rows and
columns reversed are the place turned by half a circle: the same way driven from the goal to
the start. Both at once are rows reversed alone. A disc that gets across one of the four gets
across all. That the fleet found one of them hard does not say that the way back, which
meets the same gap from its other side, is hard as well.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ses_core.arrays import BoolArray
from ses_core.scorecard.distances import distinct_maps


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedMirror:
    """Draws recorded places (N, 30, 30), mirrored, turned, both or neither."""

    cells: BoolArray

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
        """Draw without replacement; fewer than `count` where there are no more different ones."""
        courses = distinct_maps(four_courses(self.cells)).cells
        return courses[rng.permutation(len(courses))[:count]]

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """Give what rebuilds it."""
        return {"cells": self.cells}


def four_courses(cells: BoolArray) -> BoolArray:
    """Give places (N, 30, 30) as they are, mirrored, turned by half a circle, and both (4 N)."""
    mirrored = cells[:, :, ::-1]
    turned = cells[:, ::-1, ::-1]
    return np.concatenate((cells, mirrored, turned, cells[:, ::-1, :]))
