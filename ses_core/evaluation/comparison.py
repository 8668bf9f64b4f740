"""The first policy against each other one, trial by trial, and what the night may say of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ses_core.evaluation.episodes import Episode
from ses_core.evaluation.statistics import Interval, ratio_interval, restricted_time

LEAST_ENVIRONMENTS = 100
"""With fewer held-out worlds the evidence is insufficient, whatever the figures."""

SUCCESS_MARGIN = 0.03
"""A success rate lower by less than this counts as not inferior."""

Verdict = Literal["insufficient evidence", "better", "worse", "no difference shown"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Policy minus baseline over the trials both have driven.

    Attributes:
        success_difference: As a fraction.
        ci: 95 % interval of it, clustered by world; None with fewer than two worlds.
        time_difference_s: Of the mean time with failures counted as 100 s.
        ci_s: 95 % interval of that.
    """

    policy: str
    baseline: str
    success_difference: float
    ci: Interval | None
    time_difference_s: float
    ci_s: Interval | None
    trials: int
    worlds: int


def compare(episodes: Sequence[Episode], *, seed: int = 0) -> list[Comparison]:
    """Compare the first policy that appears with each other one, in their order.

    Raises:
        ValueError: A policy has not driven the same trials as the first.
    """
    names = list(dict.fromkeys(episode.policy for episode in episodes))
    trials = {
        name: {_trial_of(episode): episode for episode in episodes if episode.policy == name}
        for name in names
    }
    return [
        _comparison(names[0], trials[names[0]], name, trials[name], seed=seed) for name in names[1:]
    ]


def judge(comparison: Comparison) -> Verdict:
    """Put a comparison into words: the primary measure is the time with failures at the cap.

    `better` asks for an interval of time below 0 with success not inferior by 3 points;
    `worse` for an interval of time above 0 or one of success below 0.
    """
    if comparison.worlds < LEAST_ENVIRONMENTS or comparison.ci is None or comparison.ci_s is None:
        return "insufficient evidence"
    if comparison.ci_s[0] > 0.0 or comparison.ci[1] < 0.0:
        return "worse"
    if comparison.ci_s[1] < 0.0 and comparison.ci[0] > -SUCCESS_MARGIN:
        return "better"
    return "no difference shown"


def _trial_of(episode: Episode) -> tuple[str, int, int, int]:
    return (episode.world_id, episode.pair, episode.trial, episode.seed)


def _comparison(
    policy: str,
    ours: dict[tuple[str, int, int, int], Episode],
    baseline: str,
    theirs: dict[tuple[str, int, int, int], Episode],
    *,
    seed: int,
) -> Comparison:
    if ours.keys() != theirs.keys():
        raise ValueError(
            f"{policy} and {baseline} share {len(ours.keys() & theirs.keys())} trials, "
            f"expected all of {len(ours)} and {len(theirs)}"
        )
    shared = list(ours)
    worlds = [ours[trial].world_id for trial in shared]
    success = np.array(
        [
            float(ours[trial].outcome == "success") - float(theirs[trial].outcome == "success")
            for trial in shared
        ]
    )
    time = np.array(
        [restricted_time(ours[trial]) - restricted_time(theirs[trial]) for trial in shared]
    )
    every = np.ones(len(shared))
    return Comparison(
        policy=policy,
        baseline=baseline,
        success_difference=float(success.mean()),
        ci=ratio_interval(success, every, worlds, seed=seed),
        time_difference_s=float(time.mean()),
        ci_s=ratio_interval(time, every, worlds, seed=seed),
        trials=len(shared),
        worlds=len(set(worlds)),
    )
