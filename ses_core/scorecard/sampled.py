"""What is compared: some of the real environments, some of the synthesized, and halvings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ses_core.arrays import BoolArray
from ses_core.scorecard.distances import DistinctMaps, distinct_maps
from ses_core.scorecard.halving import LEAST_IN_HALF, Grouping, Halving, halvings


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampled:
    """Environments to compare, N real ones before M synthesized ones.

    Attributes:
        maps: Of all N + M.
        grouping: Of the real ones.
        splits: Halvings; none where there are too few for any.
    """

    maps: DistinctMaps
    grouping: Grouping
    splits: Sequence[Halving]

    @property
    def real_count(self) -> int:
        """N."""
        return len(self.grouping.labels)

    @property
    def size(self) -> int:
        """Environments on each side of a comparison."""
        return len(self.splits[0].reference) if self.splits else 0

    def shortage(self) -> str:
        """Say that nothing could be halved, where that is so."""
        if self.splits:
            return ""
        return (
            f"too few: n={self.real_count} real and "
            f"{len(self.maps.index) - self.real_count} synthesized, expected {LEAST_IN_HALF} "
            "synthesized and as many real ones in each half"
        )


def sample_both(
    real: BoolArray,
    synthesized: BoolArray,
    grouping: Grouping,
    *,
    most_real: int,
    most_synthesized: int,
    repeats: int,
    rng: Generator,
) -> Sampled:
    """Choose at most so many of each side at random, and halve the real ones.

    Args:
        real: (N, 30, 30) recorded environments.
        synthesized: (M, 30, 30).
        grouping: Which of the real ones belong together.
        most_real: Most real ones kept.
        most_synthesized: Most synthesized ones kept, and most on a side of a comparison.
        repeats: Halvings to draw.
        rng: Source of chance.
    """
    ours = rng.permutation(len(real))[:most_real]
    theirs = rng.permutation(len(synthesized))[:most_synthesized]
    kept = Grouping(grouping.kind, grouping.labels[ours])
    return Sampled(
        maps=distinct_maps(np.concatenate((real[ours], synthesized[theirs]))),
        grouping=kept,
        splits=halvings(
            kept, synthesized=len(theirs), repeats=repeats, most=most_synthesized, rng=rng
        ),
    )
