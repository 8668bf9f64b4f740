"""Filter: which scenarios of the last days are challenging, and which places are held out."""

from collections.abc import Sequence
from datetime import date
from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE

from ses_core.extraction.selection import select_challenging
from ses_core.recipes import ArtifactRef, Recipe, settings_json
from ses_core.settings import FilterSettings
from storage.artifact_store import LocalArtifactStore
from storage.batch_rows import read_batch_rows
from storage.materialize import Materialized, materialize
from storage.selection_files import write_selection
from storage.stages import FILTER
from storage.table_log import TableLog
from tasks.outcome import conclude


@task(name="select challenging scenarios", cache_policy=NO_CACHE)
def select_scenarios(
    extracted: Sequence[ArtifactRef],
    *,
    last_batch: date,
    store: LocalArtifactStore,
    tables: TableLog,
    settings: FilterSettings,
    anew: bool = False,
) -> Materialized:
    """Choose the pool that is synthesized from and the places that are held out."""
    recipe = Recipe(
        FILTER,
        {"filter": settings_json(settings), "last_batch": last_batch.isoformat()},
        input_set=frozenset(extracted),
    )

    def build(directory: Path) -> None:
        rows = read_batch_rows(store, tables, newest=last_batch)
        logs = rows.logs
        selection = select_challenging(
            rows.scenarios,
            rows.environments,
            settings=settings,
            last_batch=last_batch,
            map_logs=frozenset(logs.loc[logs["pose_source"] == "map", "log_id"]),
        )
        chosen = {*selection.pool["environment_id"], *selection.heldout["environment_id"]}
        write_selection(directory, selection, rows.whole_environments(chosen))

    return conclude(materialize(store, recipe, build, anew=anew))
