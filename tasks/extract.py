"""Extract: one log's trajectories to scenarios with their places (section III-B)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE

from ses_core.extraction.extract import extract
from ses_core.extraction.robot_matching import profile_named
from ses_core.recipes import ArtifactRef, JsonValue, Recipe, settings_json
from ses_core.settings import Settings
from storage.artifact_store import LocalArtifactStore
from storage.log_catalogue import CatalogueEntry
from storage.materialize import Materialized, materialize
from storage.scenario_tables import write_extracted
from storage.site_maps import SiteMap, read_site_maps
from storage.stages import EXTRACT
from storage.table_log import TableLog
from storage.table_parts import artifact_parts
from storage.trajectory_tables import read_log_row, read_recorded_map, read_trajectories
from tasks.outcome import conclude


@dataclass(frozen=True, slots=True, kw_only=True)
class ExtractionState:
    """Which logs are extracted under today's settings, and which are still to be."""

    extracted: tuple[ArtifactRef, ...]
    pending: tuple[CatalogueEntry, ...]
    found: bool


def extraction_recipes(
    logs: Iterable[CatalogueEntry], settings: Settings, site_maps: Mapping[str, SiteMap]
) -> dict[CatalogueEntry, Recipe]:
    """Say what decides each log's scenarios: its trajectories, the settings, the target robot.

    `is_challenging` follows the filter's settings at the time; a night's own choice stands in
    the table of selections, so another threshold extracts nothing anew.
    """
    asked: dict[str, JsonValue] = {
        "extraction": settings.extraction.model_dump(mode="json", exclude={"site_maps"}),
        "site_maps": {site: one.digest for site, one in site_maps.items()},
        "profiles": settings.ingest.model_dump(mode="json", include={"profiles"}),
        "target_robot": settings_json(settings.target_robot),
    }
    return {log: Recipe(EXTRACT, asked, inputs=(log.ref,)) for log in logs}


@task(name="look for scenarios extracted before", cache_policy=NO_CACHE)
def look_for_scenarios(
    logs: Sequence[CatalogueEntry],
    *,
    store: LocalArtifactStore,
    tables: TableLog,
    settings: Settings,
) -> ExtractionState:
    """Divide the logs into those whose scenarios are in the tables and those still to do."""
    shown = {part.ref for part in tables.parts("scenarios")}
    site_maps = read_site_maps(settings.extraction.site_maps)
    recipes = extraction_recipes(logs, settings, site_maps)
    refs = {log: store.find(recipe) for log, recipe in recipes.items()}
    pending = tuple(log for log, ref in refs.items() if ref is None or ref not in shown)
    extracted = tuple(ref for ref in refs.values() if ref is not None and ref in shown)
    return conclude(
        ExtractionState(extracted=extracted, pending=pending, found=bool(logs) and not pending)
    )


@task(name="extract scenarios", task_run_name="extract log {log.log_id:.12}", cache_policy=NO_CACHE)
def extract_scenarios(
    log: CatalogueEntry,
    *,
    store: LocalArtifactStore,
    tables: TableLog,
    settings: Settings,
    anew: bool = False,
) -> Materialized:
    """Cut one log's trajectories into scenarios and rebuild each one's place."""
    site_maps = read_site_maps(settings.extraction.site_maps)

    def build(directory: Path) -> None:
        folder = store.path(log.ref)
        row = read_log_row(folder)
        site = str(row["site"])
        of_site = site_maps.get(site) if row["pose_source"] == "map" else None
        extracted = extract(
            read_trajectories(folder),
            log_id=log.log_id,
            recorded_map=of_site.recorded if of_site else read_recorded_map(folder),
            settings=settings.extraction,
            profile=profile_named(str(row["profile"]), settings.ingest),
            target=settings.target_robot,
        )
        write_extracted(
            directory,
            log_id=log.log_id,
            robot=str(row["robot"]),
            site=site,
            batch_date=log.batch_date.isoformat(),
            extracted=extracted,
            filter_settings=settings.filter,
        )

    recipe = extraction_recipes([log], settings, site_maps)[log]
    made = materialize(store, recipe, build, anew=anew)
    parts = artifact_parts(store, made.ref, name=log.log_id, batch_date=log.batch_date)
    tables.commit(parts, message=f"scenarios of log {log.log_id}")
    return conclude(made)
