"""Rows that compare whole samples: precision, recall, density, coverage and MMD^2."""

import numpy as np
from numpy.random import Generator

from ses_core.arrays import Float32Array
from ses_core.scorecard.distances import (
    CLEARANCE_CAP_M,
    DistinctMaps,
    clearance_feature,
    differing_cells,
    euclidean,
)
from ses_core.scorecard.manifolds import manifold_scores
from ses_core.scorecard.mean_discrepancy import (
    gaussian_kernel,
    median_bandwidth,
    mmd_squared,
    permutation_p_value,
)
from ses_core.scorecard.rows import Halved, ScorecardRow, halved_row
from ses_core.scorecard.sampled import Sampled
from ses_core.scorecard_settings import ScorecardSettings

MANIFOLD_METRICS = ("precision", "recall", "density", "coverage")

FEATURES = {
    "cells (Hamming)": "cells",
    f"clearance capped at {CLEARANCE_CAP_M:g} m (Euclidean)": "m",
}
"""Names of the features, with the unit of their distances."""


def sample_rows(
    sampled: Sampled, *, settings: ScorecardSettings, rng: Generator
) -> list[ScorecardRow]:
    """Compare samples in each feature."""
    rows = []
    for feature, unit in FEATURES.items():
        distances = _distances(sampled.maps, feature)
        rows += _manifold_rows(distances, sampled, feature, settings=settings)
        rows.append(_mmd_row(distances, sampled, feature, unit, settings=settings, rng=rng))
    return rows


def _distances(maps: DistinctMaps, feature: str) -> Float32Array:
    if feature.startswith("cells"):
        return differing_cells(maps.cells, maps.cells)
    return euclidean(clearance_feature(maps.cells))


def _manifold_rows(
    distances: Float32Array,
    sampled: Sampled,
    feature: str,
    *,
    settings: ScorecardSettings,
) -> list[ScorecardRow]:
    k = settings.neighbours
    index = sampled.maps.index
    pairs = [
        tuple(
            manifold_scores(distances, index[split.reference], index[other], k=k)
            for other in (split.synthesized, split.heldout)
        )
        for split in sampled.splits
    ]
    note = sampled.shortage()
    if sampled.splits and all(found is None for pair in pairs for found in pair):
        note = f"too few: n={sampled.size} in a half, expected more than k={k} different ones"
    return [
        halved_row(
            metric,
            f"{feature}, k={k}",
            "share" if metric != "density" else "ratio",
            "as real" if metric == "density" else "high",
            Halved(
                values=[None if a is None else float(getattr(a, metric)) for a, _ in pairs],
                real_values=[None if b is None else float(getattr(b, metric)) for _, b in pairs],
                size=sampled.size,
            ),
            halves=sampled.grouping.named(),
            note=note,
        )
        for metric in MANIFOLD_METRICS
    ]


def _mmd_row(
    distances: Float32Array,
    sampled: Sampled,
    feature: str,
    unit: str,
    *,
    settings: ScorecardSettings,
    rng: Generator,
) -> ScorecardRow:
    index = sampled.maps.index
    bandwidth = median_bandwidth(distances, index)
    kernel = gaussian_kernel(distances, bandwidth)
    values: list[float] = []
    real_values: list[float] = []
    p_values: list[tuple[float, float]] = []
    for split in sampled.splits:
        reference, heldout = index[split.reference], index[split.heldout]
        synthesized = index[split.synthesized]
        values.append(mmd_squared(kernel, reference, synthesized))
        real_values.append(mmd_squared(kernel, reference, heldout))
        p_values.append(
            (
                permutation_p_value(
                    kernel, reference, synthesized, permutations=settings.permutations, rng=rng
                ),
                permutation_p_value(
                    kernel, reference, heldout, permutations=settings.permutations, rng=rng
                ),
            )
        )
    middle = np.median(p_values, axis=0) if p_values else None
    return halved_row(
        "MMD^2",
        f"{feature}, Gaussian kernel of the median distance {bandwidth:.4g} {unit}",
        "squared kernel distance",
        "low",
        Halved(values=values, real_values=real_values, size=sampled.size),
        halves=sampled.grouping.named(),
        note=sampled.shortage(),
        p_values=None if middle is None else (float(middle[0]), float(middle[1])),
    )
