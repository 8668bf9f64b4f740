"""Synthesize: from the pool of challenging environments to the ones that are trained in."""

import shutil
from dataclasses import asdict
from pathlib import Path

import numpy as np
from prefect import task
from prefect.cache_policies import NO_CACHE

from ses_core.recipes import ArtifactRef, Recipe, settings_json
from ses_core.robot_profile import RobotProfile
from ses_core.synthesis.synthesize import draw_environments, fit_synthesis, is_training
from ses_core.synthesis_settings import SynthesisSettings
from storage.artifact_store import LocalArtifactStore
from storage.earlier_fits import earlier_fit, go_on
from storage.environment_files import (
    ENVIRONMENTS_FILE,
    SYNTHESIS_FILE,
    read_environments,
    write_environments,
)
from storage.materialize import Materialized, materialize
from storage.night_report import SynthesisUse
from storage.selection_files import POOL_FOLDER, domain_digest, read_pool
from storage.stage_records import write_record
from storage.stages import FILTER, FIT, SYNTHESIZE
from storage.synthesizer_files import read_synthesizer, write_synthesizer
from tasks.outcome import conclude
from tasks.progress import report_progress


@task(name="import environments", cache_policy=NO_CACHE)
def import_environments(source: Path, *, store: LocalArtifactStore) -> Materialized:
    """Take a folder of environments for a pool, in its order."""
    domain = read_environments(source)
    recipe = Recipe(FILTER, {"imported": domain_digest(domain)})

    def build(directory: Path) -> None:
        folder = directory / POOL_FOLDER
        folder.mkdir()
        shutil.copyfile(source / ENVIRONMENTS_FILE, folder / ENVIRONMENTS_FILE)

    return conclude(materialize(store, recipe, build))


@task(name="fit the synthesizer", cache_policy=NO_CACHE)
def fit_synthesizer(
    selection: ArtifactRef,
    *,
    store: LocalArtifactStore,
    settings: SynthesisSettings,
    anew: bool = False,
) -> Materialized:
    """Learn what the challenging environments look like; anew only when their set changed.

    A warm start goes on from the newest fit of the same synthesizer to other environments; that
    fit is an input of the recipe, so a warm fit never answers for one from nothing.
    """
    pool = read_pool(store.path(selection))
    trains = is_training(settings, available=len(pool.environments))
    recipe = Recipe(
        FIT,
        {
            "pool": domain_digest(pool),
            "synthesizer": settings_json(settings.synthesizer),
            "environments": None if trains else settings.environments,
            "seed": settings.seed,
        },
    )
    if settings.warm_start and trains:
        recipe = go_on(recipe, store=store, anew=anew)

    def build(directory: Path) -> None:
        rng = np.random.default_rng([settings.seed, 0])
        progress = report_progress("synthesize")
        start = earlier_fit(recipe, store=store)
        write_synthesizer(
            directory,
            fit_synthesis(pool, settings=settings, rng=rng, progress=progress, start=start),
        )

    return conclude(materialize(store, recipe, build, anew=anew))


@task(name="sample environments", cache_policy=NO_CACHE)
def sample_environments(
    fit: ArtifactRef,
    selection: ArtifactRef,
    *,
    store: LocalArtifactStore,
    settings: SynthesisSettings,
    target: RobotProfile,
    anew: bool = False,
) -> Materialized:
    """Draw environments until enough of them can be crossed by the target robot."""
    pool = read_pool(store.path(selection))
    recipe = Recipe(
        SYNTHESIZE,
        {
            "pool": domain_digest(pool),
            "environments": settings.environments,
            "attempts": settings.attempts,
            "uncrossable": settings.uncrossable,
            "most_repaired_cells": settings.most_repaired_cells,
            "seed": settings.seed,
            "inscribed_radius_m": target.inscribed_radius_m,
        },
        inputs=(fit,),
    )

    def build(directory: Path) -> None:
        result = draw_environments(
            read_synthesizer(store.path(fit)),
            pool,
            settings=settings,
            target=target,
            rng=np.random.default_rng([settings.seed, 1]),
        )
        write_environments(directory, result.environments, target=target)
        used = SynthesisUse(
            method_asked=result.method_asked,
            method_used=result.method_used,
            drawn=result.drawn,
            rejected_share=result.rejected_share,
            repeated=result.repeated,
            copied=len(result.copies),
            repaired=result.repaired,
            repaired_cells=result.repaired_cells,
            beyond_repair=result.beyond_repair,
            notes=result.notes,
        )
        write_record(directory / SYNTHESIS_FILE, asdict(used))

    return conclude(materialize(store, recipe, build, anew=anew))
