"""Scorecard: real and synthesized environments, and how well one stands for the other."""

from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE

from ses_core.arrays import BoolArray
from ses_core.navigation import NavigationDomain
from ses_core.recipes import ArtifactRef, JsonValue, Recipe, digest_json, settings_json
from ses_core.scorecard.halving import Grouping, coarsest_grouping
from ses_core.scorecard.result import Scorecard
from ses_core.scorecard.rows import ScorecardRow
from ses_core.scorecard.scorecard import Driver, score_environments
from ses_core.settings import Settings
from storage.artifact_store import LocalArtifactStore
from storage.durable_files import replace_file
from storage.environment_files import read_environments
from storage.layout import Layout
from storage.materialize import Materialized, materialize
from storage.policy_files import NamedPolicy, find_policy
from storage.scorecard_files import (
    group_environments,
    raw_traversable_share,
    read_synthesis_use,
    write_scorecard,
    write_scored,
)
from storage.selection_files import domain_digest, read_selection
from storage.stages import SCORECARD
from tasks.outcome import conclude
from tasks.progress import report_progress

PICTURE_FILE = "scorecard.png"
PAGE_FILE = "scorecard.html"


@task(name="score the night's environments", cache_policy=NO_CACHE)
def score_artifacts(
    selection: ArtifactRef,
    environments: ArtifactRef,
    *,
    policy: str,
    store: LocalArtifactStore,
    settings: Settings,
    anew: bool = False,
) -> Materialized:
    """Compare synthesized environments with the pool they were learned from.

    Args:
        selection: Whose pool they were learned from.
        environments: The synthesized ones.
        policy: Who drives through them, by name.
        store: Where the scorecard goes.
        settings: Those of `scorecard` and `simulation` and the target robot matter.
        anew: Compare although it was done before.
    """
    chosen = read_selection(store.path(selection))
    recorded, pool = chosen.pool_environments, chosen.pool
    groups = coarsest_grouping(
        pool["site"].tolist(), pool["log_id"].tolist(), count=len(recorded.environments)
    )
    driver = find_policy(policy, store.layout)
    asked: dict[str, JsonValue] = {
        "pool": domain_digest(recorded),
        "groups": digest_json([groups.kind, *groups.labels.tolist()]),
        "scorecard": settings_json(settings.scorecard),
        "simulation": settings_json(settings.simulation),
        "target_robot": settings_json(settings.target_robot),
        "policy": [driver.name, driver.policy_id],
    }

    def build(directory: Path) -> None:
        folder = store.path(environments)
        write_scored(directory, _score(recorded, folder, groups, driver, settings))

    return conclude(
        materialize(store, Recipe(SCORECARD, asked, inputs=(environments,)), build, anew=anew)
    )


@task(name="score environments", cache_policy=NO_CACHE)
def score_folders(
    real: Path,
    synthesized: Path,
    *,
    policy: str,
    out: Path | None,
    root: Path,
    settings: Settings,
    training: Path | None = None,
) -> tuple[ScorecardRow, ...]:
    """Compare a folder of synthesized environments with a folder of real ones.

    Args:
        real: Folder of `environments.parquet`, best with the `scenarios.parquet` they are of.
        synthesized: Folder of `environments.parquet`.
        policy: Who drives through them, by name.
        out: Folder for table, page and picture, if they are wanted.
        root: Folder of the store, in which policies, sites and logs are looked up.
        settings: Those of `scorecard` and `simulation` and the target robot matter.
        training: Folder of what was learned from, where the real ones were held out.

    Raises:
        ArtifactError: A folder holds no environments.
        SchemaError: A file is no table of environments.
    """
    recorded, layout = read_environments(real), Layout(root)
    groups = group_environments(real, recorded, layout)
    learned_from = read_environments(training).cells() if training else None
    driver = find_policy(policy, layout)
    found = _score(recorded, synthesized, groups, driver, settings, learned_from)
    if out is not None:
        # matplotlib takes half a second to import: only who draws pays for it.
        from ses_core.pictures.scorecard_figure import draw_scorecard
        from storage.scorecard_page import ScorecardPage, render_scorecard_page

        write_scorecard(out, found.rows)
        replace_file(out / PICTURE_FILE, draw_scorecard(found.rows, found.measures))
        page = ScorecardPage(
            real_name=real.name,
            synthesized_name=synthesized.name,
            robot=settings.target_robot.name,
            scorecard=found,
            synthesis=read_synthesis_use(synthesized),
            real=recorded,
            synthesized=read_environments(synthesized),
        )
        replace_file(out / PAGE_FILE, render_scorecard_page(page).encode())
    return found.rows


def _score(
    recorded: NavigationDomain,
    synthesized: Path,
    groups: Grouping,
    driver: NamedPolicy,
    settings: Settings,
    training: BoolArray | None = None,
) -> Scorecard:
    """Score a folder of synthesized environments, with progress."""
    return score_environments(
        recorded.cells(),
        read_environments(synthesized).cells(),
        groups,
        settings=settings.scorecard,
        target=settings.target_robot,
        driver=Driver(name=driver.name, policy=driver.policy, simulation=settings.simulation),
        training=training,
        raw_traversable=raw_traversable_share(synthesized),
        progress=report_progress("scorecard"),
    )
