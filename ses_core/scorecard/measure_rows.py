"""Rows about measures of single environments: their level, and how far distributions differ."""

import numpy as np
from scipy.stats import wasserstein_distance

from ses_core.arrays import BoolArray, FloatArray, IntArray
from ses_core.scorecard.halving import LEAST_IN_HALF, Grouping
from ses_core.scorecard.rows import Halved, ScorecardRow, halved_row, level_row
from ses_core.scorecard.sampled import Sampled
from ses_core.synthesis.traversability import traversable


def traversable_rows(
    real: BoolArray,
    synthesized: BoolArray,
    grouping: Grouping,
    *,
    radius: float,
    raw_share: float | None,
    seed: int,
) -> list[ScorecardRow]:
    """Give the share that a disc of a radius [m] can cross: as drawn, and as handed on."""
    shipped = level_row(
        "traversable, shipped",
        f"disc of {radius:.3f} m",
        "share",
        "high",
        traversable(synthesized, radius=radius).astype(np.float64),
        traversable(real, radius=radius).astype(np.float64),
        real_groups=[str(label) for label in grouping.labels],
        halves=grouping.named(),
        seed=seed,
    )
    raw = ScorecardRow(
        metric="traversable, raw",
        feature=shipped.feature,
        unit="share",
        aim="high",
        value=raw_share,
        real_value=shipped.real_value,
        real_low=shipped.real_low,
        real_high=shipped.real_high,
        n_real=shipped.n_real,
        n_synthesized=shipped.n_synthesized,
        halves=shipped.halves,
        note=""
        if raw_share is not None
        else "unknown: no record of the draws lies beside the environments",
    )
    return [raw, shipped]


def measure_rows(
    name: str,
    unit: str,
    feature: str,
    values: FloatArray,
    sampled: Sampled,
    *,
    seed: int,
) -> list[ScorecardRow]:
    """Give the mean of a measure, and the Wasserstein-1 distance of its distributions.

    Args:
        name: Of the measure.
        unit: Of the measure.
        feature: What it was taken on.
        values: (N + M,), the real ones first; nan where unknown.
        sampled: The environments.
        seed: Of the resampling.
    """
    level = level_row(
        f"mean {name}",
        feature,
        unit,
        "as real",
        values[sampled.real_count :],
        values[: sampled.real_count],
        real_groups=[str(label) for label in sampled.grouping.labels],
        halves=sampled.grouping.named(),
        seed=seed,
    )
    distances = Halved(
        values=[distance_of(values, one.reference, one.synthesized) for one in sampled.splits],
        real_values=[distance_of(values, one.reference, one.heldout) for one in sampled.splits],
        size=sampled.size,
    )
    unknown = int(np.isnan(values).sum())
    note = sampled.shortage()
    if sampled.splits and all(value is None for value in distances.values):
        note = f"too few: expected {LEAST_IN_HALF} known values on each side"
    elif unknown and not note:
        note = f"{unknown} of {len(values)} environments have no value"
    return [
        level,
        halved_row(
            f"Wasserstein-1 {name}",
            feature,
            unit,
            "low",
            distances,
            halves=sampled.grouping.named(),
            note=note,
        ),
    ]


def distance_of(values: FloatArray, first: IntArray, second: IntArray) -> float | None:
    """Give the Wasserstein-1 distance of two samples' known values; None with too few of them."""
    ours, theirs = values[first], values[second]
    ours, theirs = ours[np.isfinite(ours)], theirs[np.isfinite(theirs)]
    if min(len(ours), len(theirs)) < LEAST_IN_HALF:
        return None
    return float(wasserstein_distance(ours, theirs))
