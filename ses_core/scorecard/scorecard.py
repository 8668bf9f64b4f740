"""The scorecard: every way in which synthesized environments may fail to stand for real ones."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ses_core.arrays import BoolArray
from ses_core.protocols import Policy
from ses_core.robot_profile import RobotProfile
from ses_core.scorecard.copy_rows import copy_rows
from ses_core.scorecard.driving import DRIVEN_MEASURES, driven_measures
from ses_core.scorecard.halving import Grouping
from ses_core.scorecard.measure_rows import measure_rows, traversable_rows
from ses_core.scorecard.measures import (
    PATH_MEASURES,
    SHAPE_MEASURES,
    path_measures,
    shape_measures,
)
from ses_core.scorecard.result import Measured, Scorecard
from ses_core.scorecard.sample_rows import sample_rows
from ses_core.scorecard.sampled import sample_both
from ses_core.scorecard_settings import ScorecardSettings
from ses_core.settings import SimulationSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class Driver:
    """Who drives through the environments, and how."""

    name: str
    policy: Policy
    simulation: SimulationSettings


def score_environments(
    real: BoolArray,
    synthesized: BoolArray,
    grouping: Grouping,
    *,
    settings: ScorecardSettings,
    target: RobotProfile,
    driver: Driver,
    training: BoolArray | None = None,
    raw_traversable: float | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Scorecard:
    """Compare synthesized environments with real ones.

    Args:
        real: (N, 30, 30) recorded environments: what was learned from, if no `training` is given,
            else held-out ones of other sites.
        synthesized: (M, 30, 30).
        grouping: Which of the real ones belong together.
        settings: Sizes, seeds and thresholds.
        target: Robot that has to cross them.
        driver: Policy whose drives tell how hard they are.
        training: (T, 30, 30) what was learned from, among which copies are looked for.
        raw_traversable: Share of all samples that could be crossed, where known.
        progress: Hears the share that is done, from 0 to 1.
    """
    rng = np.random.default_rng(settings.seed)
    sampled, driven = (
        sample_both(
            real,
            synthesized,
            grouping,
            most_real=2 * most,
            most_synthesized=most,
            repeats=settings.halvings,
            rng=rng,
        )
        for most in (settings.sample, settings.driven)
    )
    rows = [
        *traversable_rows(
            real,
            synthesized,
            grouping,
            radius=target.inscribed_radius_m,
            raw_share=raw_traversable,
            seed=settings.seed,
        ),
        *sample_rows(sampled, settings=settings, rng=rng),
        *copy_rows(
            real, synthesized, grouping, sampled, settings=settings, rng=rng, training=training
        ),
    ]
    places = shape_measures(sampled.maps.cells) | path_measures(
        sampled.maps.cells,
        radius=target.inscribed_radius_m,
        progress=lambda share: progress(0.3 * share),
    )
    drives = driven_measures(
        driven.maps.cells,
        driver.name,
        driver.policy,
        simulation=driver.simulation,
        profile=target,
        seed=settings.seed,
        progress=lambda share: progress(0.3 + 0.7 * share),
    )
    measures = {}
    for name, unit in (SHAPE_MEASURES | PATH_MEASURES | DRIVEN_MEASURES).items():
        own = driven if name in drives else sampled
        # Each distinct map is measured once: copies are alike in everything.
        values = (drives if name in drives else places)[name][own.maps.index]
        feature = f"drives of {driver.name}" if name in drives else _FEATURES.get(name, "cells")
        rows += measure_rows(name, unit, feature, values, own, seed=settings.seed)
        measures[name] = Measured(
            unit=unit, real=values[: own.real_count], synthesized=values[own.real_count :]
        )
    return Scorecard(rows=tuple(rows), measures=measures)


_FEATURES = dict.fromkeys(PATH_MEASURES, "shortest path of the target's disc") | {
    "components": "obstacles, touching corners joined"
}
