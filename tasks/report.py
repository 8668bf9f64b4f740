"""Report: the night's rows in the tables, its page, and its scorecard beside that."""

from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE

from ses_core.recipes import Recipe
from storage.artifact_store import LocalArtifactStore
from storage.durable_files import replace_file
from storage.materialize import Materialized, materialize
from storage.night_artifacts import NightArtifacts
from storage.night_contents import gather_night
from storage.night_tables import write_night_tables
from storage.scorecard_files import place_scorecard, write_scorecard
from storage.stages import REPORT
from storage.table_log import TableLog
from storage.table_parts import artifact_parts
from tasks.outcome import conclude

PAGE = "index.html"


@task(name="write the report", cache_policy=NO_CACHE)
def report_night(
    night: NightArtifacts, *, store: LocalArtifactStore, tables: TableLog, anew: bool = False
) -> Materialized:
    """Add the night to the tables, and put its page where people look for it."""

    def build(directory: Path) -> None:
        # matplotlib takes half a second to import: only who draws pays for it.
        from storage.report_page import write_report

        write_night_tables(directory, night, store=store)
        report = gather_night(night, store=store)
        write_report(directory / PAGE, report)
        if report.scorecard is not None:
            write_scorecard(directory, report.scorecard.rows)

    made = materialize(store, Recipe(REPORT, night.key()), build, anew=anew)
    if night.selection is not None:
        parts = artifact_parts(store, made.ref, name=night.run_id, batch_date=night.batch_date)
        tables.commit(parts, message=f"night {night.run_id}")
    page = store.layout.report_page(night.batch_date)
    replace_file(page, (store.path(made.ref) / PAGE).read_bytes())
    place_scorecard(store.path(made.ref), page.parent)
    return conclude(made)
