"""From all scenarios of the last days to the pool that is synthesized from (section III-B).

`select_challenging` works on rows of the tables `scenarios` and `environments`. What decides,
in this order: the window of days, the count, the quality of the rebuilt place, what is held
out for evaluation, and the limit per robot. Ties are broken by the scenario's identity, so
equal tables give equal pools.
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import date, timedelta
from typing import Final

import numpy as np
import pandas as pd

from ses_core.arrays import FloatArray, IntArray
from ses_core.extraction.difficulty import CountKind
from ses_core.extraction.holdout import Holdout, hold_out
from ses_core.settings import FilterSettings

COUNT_COLUMNS: Final[Mapping[CountKind, str]] = {
    "negative": "negative_velocity_count",
    "not-forward": "not_forward_count",
    "reversing-seconds": "reversing_s",
}

PRINTED_KINDS: Final[tuple[CountKind, ...]] = ("negative", "not-forward")
"""Every funnel is given under both: the paper's text and its authors' code differ."""

LARGEST_THRESHOLD: Final = 200
"""The sensitivity to the threshold is given from 0 to this."""

POOL_COLUMNS: Final = (
    "rank",
    "scenario_id",
    "environment_id",
    "count",
    "log_id",
    "robot",
    "site",
    "batch_date",
)

_COLUMNS: Final = (
    "scenario_id",
    "environment_id",
    "log_id",
    "robot",
    "site",
    "batch_date",
    "kind",
    "side",
)
"""What is chosen by, beside the counts: fewer columns are sorted and copied faster."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterFunnel:
    """How many scenarios each step left, under one count.

    Attributes:
        terminal: Terminal segments in the window; they are no scenarios and go no further.
        scenarios: Scenarios in the window.
        unknown: Of these, with an unknown count: never challenging.
        challenging: Of these, with a count above the threshold or within the share.
        rejected: Of the challenging, by reason: `no_environment`, `scans_disagree`,
            `hardly_observed`, `path_not_free` or `not_traversable`; the first that applies.
        usable: The challenging that were not rejected.
        heldout: Of the usable, in places held out for evaluation.
        straddling: Of the usable, between a held-out place and another; used for neither.
        over_robot_limit: Of the rest, more than one robot may give.
        pool: What is left to synthesize from.
    """

    terminal: int
    scenarios: int
    unknown: int
    challenging: int
    rejected: Mapping[str, int]
    usable: int
    heldout: int
    straddling: int
    over_robot_limit: int
    pool: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdSensitivity:
    """Scenarios above each threshold (T,), by kind of count (T,)."""

    thresholds: FloatArray
    challenging: Mapping[str, IntArray]


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """What the filter chose.

    Attributes:
        pool: `POOL_COLUMNS`, hardest first; rank counts from 1.
        heldout: The same columns, for evaluation only: every usable scenario of held-out places,
            challenging or not, for that is what a deployed policy meets; unknown counts last.
        count_kind: The count that chose.
        funnels: By kind of count; the one that chose and both printed ones.
        sensitivity: How the set would change with the threshold.
        holdout: Which places were held out, and what a place was.
    """

    pool: pd.DataFrame
    heldout: pd.DataFrame
    count_kind: CountKind
    funnels: Mapping[CountKind, FilterFunnel]
    sensitivity: ThresholdSensitivity
    holdout: Holdout


def select_challenging(
    scenarios: pd.DataFrame,
    environments: pd.DataFrame,
    *,
    settings: FilterSettings,
    last_batch: date,
    map_logs: Collection[str] = (),
) -> Selection:
    """Choose the challenging environments of a window of days.

    Args:
        scenarios: Rows of the table of that name, of any days. Places are held out by all of
            them, so the more history is given, the less moves between the sides.
        environments: Rows of the table of that name; synthesized ones are passed over.
        settings: Count, threshold or share, window, limits and least quality.
        last_batch: Last day of the window.
        map_logs: Logs whose poses are in the frame of a map.
    """
    since = (last_batch - timedelta(days=settings.window_days - 1)).isoformat()
    holdout = hold_out(scenarios, share=settings.heldout_share, map_logs=map_logs)
    dates = scenarios["batch_date"].astype(str)
    rows = scenarios.assign(side=holdout.sides)[
        (dates >= since) & (dates <= last_batch.isoformat())
    ]
    rows = rows[[*_COLUMNS, *COUNT_COLUMNS.values()]]
    rows = rows.assign(reason=_rejections(rows, environments, settings))
    kinds: tuple[CountKind, ...] = tuple(dict.fromkeys((*PRINTED_KINDS, settings.count_kind)))
    choices = {kind: _choose(rows, kind, settings) for kind in kinds}
    chosen = choices[settings.count_kind]
    return Selection(
        pool=chosen.pool,
        heldout=chosen.heldout,
        count_kind=settings.count_kind,
        funnels={kind: choice.funnel for kind, choice in choices.items()},
        sensitivity=_sensitivity(rows),
        holdout=holdout,
    )


@dataclass(frozen=True, slots=True)
class _Choice:
    pool: pd.DataFrame
    heldout: pd.DataFrame
    funnel: FilterFunnel


def _choose(rows: pd.DataFrame, kind: CountKind, settings: FilterSettings) -> _Choice:
    """Choose under one kind of count."""
    scenarios = rows[rows["kind"] == "scenario"]
    counts = _counts(scenarios, kind)
    known = scenarios.assign(count=counts)[~np.isnan(counts)]
    ranked = known.sort_values(["count", "scenario_id"], ascending=[False, True])
    if settings.challenging_share is None:
        challenging = ranked[ranked["count"] > settings.threshold]
    else:
        most = math.ceil(settings.challenging_share * len(ranked) - 1e-9)
        # A share never reaches down to scenarios in which nothing happened at all.
        challenging = ranked[ranked["count"] > 0.0].head(most)
    usable = challenging[challenging["reason"] == ""]
    training = usable[usable["side"] == "training"]
    within_limit = training.groupby(["site", "robot"]).cumcount() < settings.per_robot_limit
    pool = _pool(training[within_limit])
    everything = scenarios.assign(count=counts)
    unseen = everything[(everything["side"] == "heldout") & (everything["reason"] == "")]
    unseen = unseen.sort_values(["count", "scenario_id"], ascending=[False, True])
    heldout = _pool(unseen.head(settings.heldout_limit))
    reasons = challenging.loc[challenging["reason"] != "", "reason"].value_counts()
    funnel = FilterFunnel(
        terminal=int((rows["kind"] == "terminal").sum()),
        scenarios=len(scenarios),
        unknown=len(scenarios) - len(known),
        challenging=len(challenging),
        rejected={str(reason): int(count) for reason, count in sorted(reasons.items())},
        usable=len(usable),
        heldout=int((usable["side"] == "heldout").sum()),
        straddling=int((usable["side"] == "straddling").sum()),
        over_robot_limit=len(training) - len(pool),
        pool=len(pool),
    )
    return _Choice(pool, heldout, funnel)


def _counts(rows: pd.DataFrame, kind: CountKind) -> FloatArray:
    """Give the counts (N,) of a kind, NaN where unknown."""
    return rows[COUNT_COLUMNS[kind]].to_numpy(dtype=np.float64, na_value=np.nan)


def _pool(rows: pd.DataFrame) -> pd.DataFrame:
    """Number rows by rank and keep the columns of a pool."""
    ranked = rows.assign(rank=np.arange(1, len(rows) + 1, dtype=np.int64))
    return ranked[list(POOL_COLUMNS)].reset_index(drop=True)


def _rejections(
    rows: pd.DataFrame, environments: pd.DataFrame, settings: FilterSettings
) -> pd.Series:
    """Say why the place of each row cannot be used; empty where it can."""
    places = environments[environments["scenario_id"] != ""]
    places = places.drop_duplicates("environment_id").set_index("environment_id")
    positions = places.index.get_indexer(pd.Index(rows["environment_id"]))
    found = places.reindex(rows["environment_id"])
    contradicted, observed, path_in_free = (
        found[column].to_numpy(dtype=np.float64, na_value=np.nan)
        for column in ("contradicted_fraction", "observed_fraction", "path_in_free_fraction")
    )
    reasons = np.select(
        [
            positions < 0,
            # Unknown for places from a map, where there is nothing to contradict.
            contradicted > settings.max_contradicted_fraction,
            ~(observed >= settings.min_observed_fraction),
            ~(path_in_free >= settings.min_path_in_free_fraction),
            ~found["is_traversable"].isin([True]).to_numpy(dtype=np.bool_),
        ],
        [
            "no_environment",
            "scans_disagree",
            "hardly_observed",
            "path_not_free",
            "not_traversable",
        ],
        default="",
    )
    return pd.Series(reasons, index=rows.index, dtype=object)


def _sensitivity(rows: pd.DataFrame) -> ThresholdSensitivity:
    """Count the scenarios above every threshold from 0 to `LARGEST_THRESHOLD`."""
    scenarios = rows[rows["kind"] == "scenario"]
    thresholds = np.arange(LARGEST_THRESHOLD + 1, dtype=np.float64)
    challenging = {}
    for kind in PRINTED_KINDS:
        counts = _counts(scenarios, kind)
        above = np.searchsorted(np.sort(counts[~np.isnan(counts)]), thresholds, side="right")
        challenging[str(kind)] = (~np.isnan(counts)).sum() - above.astype(np.int64)
    return ThresholdSensitivity(thresholds=thresholds, challenging=challenging)
