"""Difficulty: the policy a night goes on from drives again where robots struggled."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from prefect import task
from prefect.cache_policies import NO_CACHE

from ses_core.evaluation.difficulty import VerifiedDifficulty, verify
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from ses_core.recipes import ArtifactRef, JsonValue, Recipe, digest_json, settings_json
from ses_core.settings import Settings
from storage.artifact_store import LocalArtifactStore
from storage.difficulty_files import known_difficulties, logged_headings, write_difficulties
from storage.environment_files import read_environments
from storage.materialize import Materialized, materialize
from storage.policy_files import NamedPolicy, find_policy
from storage.selection_files import domain_digest, read_pool
from storage.stages import DIFFICULTY
from tasks.outcome import conclude
from tasks.progress import report_progress


@task(name="verify difficulties", cache_policy=NO_CACHE)
def verify_difficulty(
    selection: ArtifactRef,
    environments: ArtifactRef,
    *,
    policy: str,
    store: LocalArtifactStore,
    settings: Settings,
    anew: bool = False,
) -> Materialized:
    """Let a policy cross the hardest places of the pool, and all synthesized environments.

    A place that an earlier night had it cross under the same conditions is not driven again:
    what is found of a place depends on none beside it.

    Args:
        selection: Whose pool the recorded places are from.
        environments: The synthesized ones.
        policy: Who drives, by name.
        store: Where the difficulties go.
        settings: Those of `difficulty` and `simulation` and the target robot matter.
        anew: Drive although it was done before.
    """
    recorded = read_pool(store.path(selection)).environments[: settings.difficulty.recorded]
    synthesized = read_environments(store.path(environments)).environments
    both = {one.environment_id: one for one in (*recorded, *synthesized)}
    headings = logged_headings(store.layout.root, recorded)
    driver = find_policy(policy, store.layout)
    asked: dict[str, JsonValue] = {
        "policy": driver.policy_id,
        "trials": settings.difficulty.trials,
        "seed": settings.difficulty.seed,
        "simulation": settings_json(settings.simulation),
        "target_robot": settings_json(settings.target_robot),
    }
    conditions = digest_json([DIFFICULTY.name, DIFFICULTY.version, asked])[:16]

    def build(directory: Path) -> None:
        known = {} if anew else known_difficulties(store.layout.root, conditions)
        fresh = [one for key, one in both.items() if key not in known]
        driven = drive_again(fresh, driver, headings=headings, settings=settings)
        known |= {row.environment_id: row for row in driven}
        write_difficulties(directory, [known[key] for key in both], conditions=conditions)

    recipe = Recipe(
        DIFFICULTY,
        {
            **asked,
            "environments": domain_digest(NavigationDomain(tuple(both.values()))),
            "headings": digest_json(headings),
        },
    )
    return conclude(materialize(store, recipe, build, anew=anew))


def drive_again(
    environments: Sequence[NavigationEnvironment],
    driver: NamedPolicy,
    *,
    settings: Settings,
    headings: Mapping[str, float] = MappingProxyType({}),
) -> list[VerifiedDifficulty]:
    """Let a policy cross environments as the settings say, each id once, with progress."""
    return verify(
        list({one.environment_id: one for one in environments}.values()),
        driver.policy,
        policy_id=driver.policy_id,
        headings=headings,
        trials=settings.difficulty.trials,
        seed=settings.difficulty.seed,
        simulation=settings.simulation,
        profile=settings.target_robot,
        progress=report_progress("difficulty"),
    )
