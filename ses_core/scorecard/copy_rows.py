"""Rows about copies: near duplicates within a sample, and copies of what was learned from."""

import numpy as np
from numpy.random import Generator

from ses_core.arrays import BoolArray
from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.scorecard.copies import (
    Memorisation,
    memorisation,
    memorisation_beside_heldout,
    near_duplicate_share,
    nearest_of_other_groups,
    nearest_training,
)
from ses_core.scorecard.distances import (
    differing_cells,
    differing_cells_or_mirrored,
)
from ses_core.scorecard.halving import Grouping
from ses_core.scorecard.rows import Halved, ScorecardRow, halved_row, level_row
from ses_core.scorecard.sampled import Sampled
from ses_core.scorecard_settings import ScorecardSettings

_AREA = ENVIRONMENT_CELLS**2


def copy_rows(
    real: BoolArray,
    synthesized: BoolArray,
    grouping: Grouping,
    sampled: Sampled,
    *,
    settings: ScorecardSettings,
    rng: Generator,
    training: BoolArray | None = None,
) -> list[ScorecardRow]:
    """Look for copies, as they are and mirrored too.

    Without `training` the real environments are what was learned from; with it they are held out.
    """
    rows = []
    for mirrored_too in (False, True):
        rows.append(_duplicate_row(sampled, mirrored_too, settings))
        rows.append(_copy_row(real, synthesized, grouping, mirrored_too, settings, training))
        rows.append(_memorisation_row(real, synthesized, grouping, mirrored_too, rng, training))
    return rows


def _named(mirrored_too: bool) -> str:
    return "cells (Hamming), mirrored too" if mirrored_too else "cells (Hamming)"


def _duplicate_row(
    sampled: Sampled,
    mirrored_too: bool,
    settings: ScorecardSettings,
) -> ScorecardRow:
    measure = differing_cells_or_mirrored if mirrored_too else differing_cells
    apart = measure(sampled.maps.cells, sampled.maps.cells)
    most = settings.copy_share * _AREA
    return halved_row(
        "near duplicates",
        f"{_named(mirrored_too)}, at most {most:g} cells from another of the sample",
        "share",
        "low",
        Halved(
            values=[
                near_duplicate_share(apart, sampled.maps.index[one.synthesized], cells=most)
                for one in sampled.splits
            ],
            real_values=[
                near_duplicate_share(apart, sampled.maps.index[one.heldout], cells=most)
                for one in sampled.splits
            ],
            size=sampled.size,
        ),
        halves=sampled.grouping.named(),
        note=sampled.shortage(),
    )


def _copy_row(
    real: BoolArray,
    synthesized: BoolArray,
    grouping: Grouping,
    mirrored_too: bool,
    settings: ScorecardSettings,
    training: BoolArray | None,
) -> ScorecardRow:
    most = settings.copy_share * _AREA
    if training is None:
        ours = nearest_training(synthesized, real, mirrored_too=mirrored_too)
        theirs = nearest_of_other_groups(real, grouping, mirrored_too=mirrored_too)
        whose = "a real one (real ones: from one of another group)"
    else:
        ours = nearest_training(synthesized, training, mirrored_too=mirrored_too)
        theirs = nearest_training(real, training, mirrored_too=mirrored_too)
        whose = "one that was learned from"
    return level_row(
        "copies",
        f"{_named(mirrored_too)}, at most {most:g} cells from {whose}",
        "share",
        "low",
        np.where(np.isfinite(ours), ours <= most, np.nan),
        np.where(np.isfinite(theirs), theirs <= most, np.nan),
        real_groups=[str(label) for label in grouping.labels],
        halves=grouping.named(),
        seed=settings.seed,
    )


def _memorisation_row(
    real: BoolArray,
    synthesized: BoolArray,
    grouping: Grouping,
    mirrored_too: bool,
    rng: Generator,
    training: BoolArray | None,
) -> ScorecardRow:
    found = _memorisation(real, synthesized, grouping, mirrored_too, rng, training)
    if found is not None:
        middle = np.median(found.synthesized), np.median(found.real)
        others = ", of other groups" if training is None else ""
        note = (
            f"median to the nearest one learned from{others}: {middle[0]:.4g} cells, "
            f"of real ones {middle[1]:.4g} cells"
        )
    elif training is None:
        note = (
            f"too few: n={len(synthesized)} synthesized and {grouping.count} groups of real "
            "ones, expected 1 and 2"
        )
    else:
        note = (
            f"too few: n={len(synthesized)} synthesized, {len(real)} real and {len(training)} "
            "learned from, expected 1 of each"
        )
    return ScorecardRow(
        metric="memorisation",
        feature=f"{_named(mirrored_too)}, chance to be nearer to those learned from than a real "
        "one is; "
        "Mann-Whitney, one-sided",
        unit="chance",
        aim="as real",
        value=found.nearer if found else None,
        low=found.interval[0] if found else None,
        high=found.interval[1] if found else None,
        real_value=0.5 if found else None,
        p_value=found.p_value if found else None,
        n_real=len(real),
        n_synthesized=len(synthesized),
        halves=grouping.named(),
        note=note,
    )


def _memorisation(
    real: BoolArray,
    synthesized: BoolArray,
    grouping: Grouping,
    mirrored_too: bool,
    rng: Generator,
    training: BoolArray | None,
) -> Memorisation | None:
    """Compare nearness to what was learned from; None where there is too little of anything."""
    if len(synthesized) == 0:
        return None
    if training is not None:
        if len(training) == 0 or len(real) == 0:
            return None
        return memorisation_beside_heldout(
            synthesized, training, real, mirrored_too=mirrored_too, rng=rng
        )
    if grouping.count < 2:
        return None
    return memorisation(synthesized, real, grouping, mirrored_too=mirrored_too, rng=rng)
