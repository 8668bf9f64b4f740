"""How far simulated counts bear out logged ones: by rank, by class, and by those hard again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import rankdata

from ses_core.arrays import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class LabelAgreement:
    """Agreement of two counts of the same places.

    Attributes:
        places: Places compared.
        challenging: Of these, those whose logged count is above the threshold.
        correlation: Spearman's; None where there are fewer than three places, or one of the
            counts is everywhere the same.
        hard_again: Share of the challenging ones whose simulated count is above it, too.
        auc: Chance that of a challenging place and another one the first has the larger
            simulated count; None where all places are alike by the log.
    """

    places: int
    challenging: int
    correlation: float | None
    hard_again: float | None
    auc: float | None


def label_agreement(
    logged: FloatArray, simulated: FloatArray, *, threshold: float
) -> LabelAgreement:
    """Compare logged with simulated counts (N,) of the same places."""
    is_challenging = logged > threshold
    again = simulated[is_challenging] > threshold
    return LabelAgreement(
        places=len(logged),
        challenging=len(again),
        correlation=rank_correlation(logged, simulated),
        hard_again=float(again.mean()) if len(again) else None,
        auc=area_under_curve(is_challenging, simulated),
    )


def agreement_by_group(
    logged: FloatArray, simulated: FloatArray, groups: Sequence[str], *, threshold: float
) -> dict[str, LabelAgreement]:
    """Compare counts (N,) group by group, e.g. by site, in the order of their names."""
    names = np.asarray(groups, dtype=np.str_)
    return {
        str(name): label_agreement(
            logged[names == name], simulated[names == name], threshold=threshold
        )
        for name in np.unique(names)
    }


def rank_correlation(first: FloatArray, second: FloatArray) -> float | None:
    """Give Spearman's correlation of two samples (N,); None where it is not defined."""
    if len(first) < 3 or np.ptp(first) == 0.0 or np.ptp(second) == 0.0:
        return None
    return float(np.corrcoef(rankdata(first), rankdata(second))[0, 1])


def area_under_curve(is_positive: BoolArray, scores: FloatArray) -> float | None:
    """Give the chance that a positive scores above a negative; a tie counts one half."""
    positives = int(is_positive.sum())
    negatives = len(is_positive) - positives
    if not positives or not negatives:
        return None
    ranks = rankdata(scores)[is_positive].sum()
    return float((ranks - positives * (positives + 1) / 2) / (positives * negatives))
