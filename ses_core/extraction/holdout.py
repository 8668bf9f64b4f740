"""Which places are kept for evaluation: whole sites by their hash, or places of the only site.

A place never changes sides by chance: its side depends on the hash of its name. Among two or
more, the one with the lowest hash is always held out and the one with the highest never, so
that neither side is empty.
"""

import hashlib
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import pandas as pd

TILE_M: Final = 15.0
"""Side [m] of the places of one site, where poses are in the frame of its map."""

Basis = Literal["site", "place", "nothing"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Holdout:
    """How scenarios were divided.

    Attributes:
        basis: Whole sites, places of the only site, or nothing where there is one place.
        heldout: Names of the held-out sites or places, sorted.
        sides: For every scenario `training`, `heldout`, or `straddling` for one that leads
            from a held-out place into another or back, and belongs to neither side.
    """

    basis: Basis
    heldout: tuple[str, ...]
    sides: pd.Series


def hold_out(scenarios: pd.DataFrame, *, share: float, map_logs: Collection[str]) -> Holdout:
    """Divide scenarios into those to train from and those to evaluate on.

    With two sites or more, whole sites are held out. With one, places are: a log, or for logs
    whose poses are in a map's frame a tile of 15 m, so that two drives through the same place
    never end up on both sides. Scenarios of one place are never divided.

    Args:
        scenarios: Rows of the table `scenarios`.
        share: Of the sites or places, held out.
        map_logs: Logs whose poses are in the frame of a map.
    """
    sites = scenarios["site"].astype(object)
    if sites.nunique() >= 2:
        basis: Basis = "site"
        starts, goals = sites, sites
    else:
        basis = "place"
        starts = _places(scenarios, "start_x_m", "start_y_m", map_logs)
        goals = _places(scenarios, "goal_x_m", "goal_y_m", map_logs)
    heldout = choose_heldout({*starts, *goals}, share=share)
    starts_out, goals_out = starts.isin(heldout), goals.isin(heldout)
    sides = np.select(
        [starts_out & goals_out, starts_out | goals_out],
        ["heldout", "straddling"],
        default="training",
    )
    return Holdout(
        basis=basis if heldout else "nothing",
        heldout=tuple(sorted(heldout)),
        sides=pd.Series(sides, index=scenarios.index, dtype=object),
    )


def choose_heldout(names: Iterable[str], *, share: float) -> frozenset[str]:
    """Choose names by hash: about a share of them, at least one and never all of two or more."""
    ordered = sorted(names, key=lambda name: (_fraction(name), name))
    if share <= 0.0 or len(ordered) < 2:
        return frozenset()
    lowest, middle = ordered[0], ordered[1:-1]
    return frozenset([lowest, *(name for name in middle if _fraction(name) < share)])


def _places(
    scenarios: pd.DataFrame, x_column: str, y_column: str, map_logs: Collection[str]
) -> pd.Series:
    """Name the place of each scenario's start or goal."""
    logs = scenarios["log_id"].astype(str)
    x = np.floor(scenarios[x_column].to_numpy(dtype=np.float64) / TILE_M).astype(np.int64)
    y = np.floor(scenarios[y_column].to_numpy(dtype=np.float64) / TILE_M).astype(np.int64)
    tiles = pd.Series(
        [f"tile {column},{row}" for column, row in zip(x, y, strict=True)],
        index=scenarios.index,
        dtype=object,
    )
    return tiles.where(logs.isin(map_logs), logs)


def _fraction(name: str) -> float:
    """Map a name to [0, 1) by its hash."""
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big") / 2.0**64
