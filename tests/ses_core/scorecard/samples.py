"""Rooms of several sites to score: rooms of a site resemble each other."""

import numpy as np

from ses_core.arrays import BoolArray, IntArray
from ses_core.learning.policies import FIXED_POLICIES
from ses_core.robot_profile import JACKAL
from ses_core.scorecard.halving import Grouping
from ses_core.scorecard.result import Scorecard
from ses_core.scorecard.rows import ScorecardRow
from ses_core.scorecard.scorecard import Driver, score_environments
from ses_core.scorecard_settings import ScorecardSettings
from ses_core.settings import SimulationSettings

QUICK = ScorecardSettings(halvings=8, permutations=49, driven=0)


def pillars(count: int, *, seed: int, least: int = 1, most: int = 6) -> BoolArray:
    """Draw places (count, 30, 30) with `least` to `most` blocks beside a way through."""
    rng = np.random.default_rng(seed)
    cells = np.zeros((count, 30, 30), dtype=np.bool_)
    for place in cells:
        for _ in range(rng.integers(least, most + 1)):
            row, column = rng.integers(0, 27), rng.choice((*range(9), *range(18, 27)))
            place[row : row + 3, column : column + 3] = True
    return cells


def sites(*sizes: int) -> Grouping:
    """Group environments by sites of these sizes, one after the other."""
    return Grouping("site", np.repeat(np.arange(len(sizes)), sizes).astype(np.int64))


def score(
    real: BoolArray,
    synthesized: BoolArray,
    grouping: Grouping | None = None,
    *,
    settings: ScorecardSettings = QUICK,
    raw_traversable: float | None = None,
) -> Scorecard:
    """Score with the Jackal and slow DWA."""
    return score_environments(
        real,
        synthesized,
        grouping or Grouping("environment", np.arange(len(real), dtype=np.int64)),
        settings=settings,
        target=JACKAL,
        driver=Driver(
            name="dwa-slow",
            policy=FIXED_POLICIES["dwa-slow"],
            simulation=SimulationSettings(time_limit_s=30.0),
        ),
        raw_traversable=raw_traversable,
    )


def row(found: Scorecard, metric: str, feature: str = "") -> ScorecardRow:
    """Give the row of a metric whose feature begins like this."""
    (one, *_) = (x for x in found.rows if x.metric == metric and x.feature.startswith(feature))
    return one


def all_of(count: int, start: int = 0) -> IntArray:
    """Give the indices from start on."""
    return np.arange(start, start + count, dtype=np.int64)
