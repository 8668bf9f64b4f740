"""Drawn and random places to synthesize from, and synthesizers that take no time."""

import numpy as np

from ses_core.arrays import BoolArray
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from ses_core.synthesis_settings import (
    AutoregressiveSettings,
    GanPaperSettings,
    GanSettings,
    IdentitySettings,
    MedoidsSettings,
    MirrorSettings,
    PcaPaperSettings,
    PcaSettings,
    RandomSamplingSettings,
    SynthesizerSettings,
)


def domain_of(cells: BoolArray) -> NavigationDomain:
    """Make a domain of recorded places (N, 30, 30), each with a scenario of its own."""
    return NavigationDomain(
        tuple(
            NavigationEnvironment(
                environment_id=f"e{index}",
                cells=place,
                observed=np.ones_like(place),
                origin="scan",
                scenario_id=f"s{index}",
            )
            for index, place in enumerate(cells)
        )
    )


def rooms(count: int, *, seed: int = 0) -> BoolArray:
    """Draw rooms (count, 30, 30) with a wall across and a doorway of 5 cells (0.83 m) in it."""
    rng = np.random.default_rng(seed)
    cells = np.zeros((count, 30, 30), dtype=np.bool_)
    for place in cells:
        row, column = rng.integers(4, 26), rng.integers(0, 25)
        place[row : row + 2] = True
        place[row : row + 2, column : column + 5] = False
    return cells


def walled_off(count: int) -> BoolArray:
    """Draw places (count, 30, 30) that no robot can cross, no two equal."""
    cells = np.zeros((count, 30, 30), dtype=np.bool_)
    for index, place in enumerate(cells):
        place[5 + index // 30] = True
        place[28, index % 30] = True
    return cells


def families(sizes: tuple[int, ...]) -> tuple[BoolArray, list[int]]:
    """Draw places in clearly separate families: a filled block each, with two cells flipped."""
    rng = np.random.default_rng(3)
    cells, labels = [], []
    for family, size in enumerate(sizes):
        for _ in range(size):
            place = np.zeros((30, 30), dtype=np.bool_)
            place[family * 6 : family * 6 + 5] = True
            place[tuple(rng.integers(0, 30, (2, 2)))] ^= True
            cells.append(place)
            labels.append(family)
    return np.stack(cells), labels


def family_of(place: BoolArray) -> int:
    """Tell which family a place is of."""
    return int(np.argmax([place[k * 6 : k * 6 + 5].sum() for k in range(5)]))


QUICK_SYNTHESIZERS: tuple[SynthesizerSettings, ...] = (
    GanPaperSettings(epochs=1, least_updates=6),
    GanSettings(epochs=1, least_updates=6),
    PcaPaperSettings(components=12),
    PcaSettings(components=12),
    RandomSamplingSettings(),
    MedoidsSettings(),
    IdentitySettings(),
    MirrorSettings(),
    AutoregressiveSettings(reach=3, hidden=16, updates=3),
)
"""All nine, those that learn for a moment only: their samples are nothing to look at."""
