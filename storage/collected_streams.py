"""`CollectedStreams`: a bag's messages as decoded, before anything is cleaned."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ses_core.arrays import FloatArray, IntArray
from storage.message_decoding import Grid, Odometry, Scans, Transforms, Twists

BASE_FRAMES = ("base_link", "base_footprint", "base")
"""What a robot's body is called where neither profile nor odometry says."""


@dataclass(slots=True)
class CollectedStreams:
    """Messages as decoded, in blocks of one form each and in no order beyond that."""

    scans: list[Scans] = field(default_factory=list)
    odometry: list[Odometry] = field(default_factory=list)
    commands: list[Twists] = field(default_factory=list)
    poses: list[Transforms] = field(default_factory=list)
    transforms: dict[tuple[str, str], list[Transforms]] = field(default_factory=dict)
    static_edges: set[tuple[str, str]] = field(default_factory=set)
    map: Grid | None = None
    messages_in: int = 0
    warnings: Counter[str] = field(default_factory=Counter)

    def add_transforms(self, transforms: Iterable[Transforms], *, is_static: bool) -> None:
        """Keep transforms with those between the same frames."""
        for found in transforms:
            edge = (found.frame, found.child)
            self.transforms.setdefault(edge, []).append(found)
            if is_static:
                self.static_edges.add(edge)

    def add_map(self, grid: Grid) -> None:
        """Keep a map if it is the last so far."""
        self.warnings["dropped_older_map"] += self.map is not None
        if self.map is None or grid.stamp_ns >= self.map.stamp_ns:
            self.map = grid


def by_time(
    stamps: Sequence[IntArray], *columns: Sequence[FloatArray]
) -> tuple[IntArray, list[FloatArray]]:
    """Put the blocks of a stream together in order of time; equal stamps as they came.

    Args:
        stamps: Of each block, (K,) [ns].
        columns: For each column its blocks (K, N).
    """
    joined = np.concatenate(stamps)
    blocks = [np.concatenate(column) for column in columns]
    if np.all(np.diff(joined) >= 0):
        return joined, blocks
    order = np.argsort(joined, kind="stable")
    return joined[order], [block[order] for block in blocks]
