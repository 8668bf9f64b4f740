"""`ScorecardRow`: one number about synthesized environments, beside that of the real ones."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.evaluation.statistics import Interval, rate_interval, ratio_interval

Aim = Literal["high", "low", "as real"]

_RESAMPLES = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class ScorecardRow:
    """One row; the fields are the columns of the table `scorecard`.

    Attributes:
        metric: Name of what was measured.
        feature: What it was measured on, with the kernel, threshold or policy.
        unit: Of the value and of all that stands beside it.
        aim: `high`, `low`, or `as real`: as near to the real value as can be.
        value: Of the synthesized environments; None where `note` says why.
        low: Lower end of its 95 % interval.
        high: Upper end.
        real_value: The same between real environments that share no site.
        real_low: Lower end of that one's interval.
        real_high: Upper end.
        p_value: Where the metric is a test: chance of such a value were there no difference.
        real_p_value: The same between the real ones.
        n_real: Real environments in one comparison.
        n_synthesized: Synthesized ones.
        halves: How real environments were kept apart, and into how many groups.
        note: What else to know.
    """

    metric: str
    feature: str
    unit: str
    aim: Aim
    value: float | None = None
    low: float | None = None
    high: float | None = None
    real_value: float | None = None
    real_low: float | None = None
    real_high: float | None = None
    p_value: float | None = None
    real_p_value: float | None = None
    n_real: int
    n_synthesized: int
    halves: str
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Halved:
    """A score over all halvings, None where one had too little to go by.

    Attributes:
        values: Of the synthesized environments against the reference half.
        real_values: Of the other half against the reference half.
        size: Environments on each side.
    """

    values: Sequence[float | None]
    real_values: Sequence[float | None]
    size: int


def halved_row(
    metric: str,
    feature: str,
    unit: str,
    aim: Aim,
    halved: Halved,
    *,
    halves: str,
    note: str = "",
    p_values: tuple[float, float] | None = None,
) -> ScorecardRow:
    """Make the row of a score over halvings: means, and the range of 95 % of the halvings."""
    value, interval = _mean_and_range(halved.values)
    real_value, real_interval = _mean_and_range(halved.real_values)
    return ScorecardRow(
        metric=metric,
        feature=feature,
        unit=unit,
        aim=aim,
        value=value,
        low=interval[0],
        high=interval[1],
        real_value=real_value,
        real_low=real_interval[0],
        real_high=real_interval[1],
        p_value=p_values[0] if p_values else None,
        real_p_value=p_values[1] if p_values else None,
        n_real=halved.size,
        n_synthesized=halved.size,
        halves=halves,
        note=note,
    )


def level_row(
    metric: str,
    feature: str,
    unit: str,
    aim: Aim,
    values: FloatArray,
    real_values: FloatArray,
    *,
    real_groups: Sequence[str],
    halves: str,
    seed: int,
) -> ScorecardRow:
    """Make the row of means (M,) and (N,), unknown ones (nan) left out.

    The interval of the synthesized resamples environments, that of the real ones whole groups.
    """
    known, real_known = np.isfinite(values), np.isfinite(real_values)
    synthesized_names = [str(number) for number in range(len(values))]
    interval = _mean_interval(values, synthesized_names, unit=unit, seed=seed)
    real_interval = _mean_interval(real_values, real_groups, unit=unit, seed=seed)
    sides = (("real", real_known), ("synthesized", known))
    missing = [f"no {side} one is known" for side, has in sides if not has.any()]
    return ScorecardRow(
        metric=metric,
        feature=feature,
        unit=unit,
        aim=aim,
        value=_mean(values[known]) if known.any() else None,
        low=interval[0] if interval else None,
        high=interval[1] if interval else None,
        real_value=_mean(real_values[real_known]) if real_known.any() else None,
        real_low=real_interval[0] if real_interval else None,
        real_high=real_interval[1] if real_interval else None,
        n_real=int(real_known.sum()),
        n_synthesized=int(known.sum()),
        halves=halves,
        note="; ".join(f"too few: {reason}" for reason in missing),
    )


def _mean(values: FloatArray) -> float:
    """Give a mean that does not depend on the order: equal sets have equal ones."""
    return math.fsum(values) / len(values)


def _mean_interval(
    values: FloatArray, clusters: Sequence[str], *, unit: str, seed: int
) -> Interval | None:
    """Give the interval of a mean of the known values, or of a share of zeros and ones."""
    known = np.flatnonzero(np.isfinite(values))
    if len(known) == 0:
        return None
    found, of = values[known], [clusters[int(number)] for number in known]
    if unit == "share":
        return rate_interval(found, of, seed=seed, resamples=_RESAMPLES)
    return ratio_interval(found, np.ones(len(found)), of, seed=seed, resamples=_RESAMPLES)


def _mean_and_range(
    values: Sequence[float | None],
) -> tuple[float | None, tuple[float | None, float | None]]:
    known = [value for value in values if value is not None]
    if not known:
        return None, (None, None)
    low, high = np.quantile(known, (0.025, 0.975))
    return float(np.mean(known)), (float(low), float(high))
