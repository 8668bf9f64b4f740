"""Halves of the recorded environments that share no site, and synthesized ones beside them.

A half is the reference. The other half, cut to the same size, is compared with it, and so are
as many synthesized environments: what the halves differ by is as good as a generator can get.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.random import Generator

from ses_core.arrays import IntArray

GroupKind = Literal["site", "log", "environment"]

LEAST_IN_HALF = 5
"""With fewer environments on any side nothing is compared."""


@dataclass(frozen=True, slots=True)
class Grouping:
    """Which recorded environments belong together and stay in the same half.

    Attributes:
        kind: What the groups are.
        labels: (N,) the group of each environment, from 0.
    """

    kind: GroupKind
    labels: IntArray

    @property
    def count(self) -> int:
        """Number of groups."""
        return len(np.unique(self.labels))

    def named(self) -> str:
        """Say how halves are made, for a row."""
        return f"by {self.kind} ({self.count})"


@dataclass(frozen=True, slots=True)
class Halving:
    """Indices (m,) each into all environments, the recorded ones before the synthesized."""

    reference: IntArray
    heldout: IntArray
    synthesized: IntArray


def coarsest_grouping(
    sites: Sequence[str | None], logs: Sequence[str | None], *, count: int
) -> Grouping:
    """Group by site where there are two of them, else by log, else every environment by itself.

    Args:
        sites: (N,) site of each environment, None where unknown; or none at all.
        logs: (N,) log of each environment, likewise.
        count: N.
    """
    choices: tuple[tuple[GroupKind, Sequence[str | None]], ...] = (("site", sites), ("log", logs))
    for kind, names in choices:
        known = [name for name in names if name]
        if len(known) == count and len(set(known)) > 1:
            return Grouping(kind, np.unique(known, return_inverse=True)[1].astype(np.int64))
    return Grouping("environment", np.arange(count, dtype=np.int64))


def halvings(
    grouping: Grouping, *, synthesized: int, repeats: int, most: int, rng: Generator
) -> list[Halving]:
    """Draw halvings; none where a side would hold less than `LEAST_IN_HALF`.

    Args:
        grouping: Of the recorded environments.
        synthesized: Number of synthesized environments.
        repeats: Halvings to draw.
        most: Most environments on a side.
        rng: Source of chance.
    """
    drawn = []
    for _ in range(repeats):
        reference, heldout = _split(grouping.labels, rng)
        size = min(len(reference), len(heldout), synthesized, most)
        if size < LEAST_IN_HALF:
            return []
        drawn.append(
            Halving(
                reference=rng.choice(reference, size, replace=False),
                heldout=rng.choice(heldout, size, replace=False),
                synthesized=len(grouping.labels) + rng.choice(synthesized, size, replace=False),
            )
        )
    return drawn


def _split(labels: IntArray, rng: Generator) -> tuple[IntArray, IntArray]:
    """Put groups, in random order, each into the half that is smaller so far."""
    groups, sizes = np.unique(labels, return_counts=True)
    is_second = np.zeros(len(groups), dtype=np.bool_)
    filled = [0, 0]
    for number in rng.permutation(len(groups)):
        half = int(filled[1] < filled[0]) if filled[0] != filled[1] else int(rng.integers(2))
        is_second[number] = bool(half)
        filled[half] += int(sizes[number])
    in_second = is_second[np.searchsorted(groups, labels)]
    return np.flatnonzero(~in_second), np.flatnonzero(in_second)
