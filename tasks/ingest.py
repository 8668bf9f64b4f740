"""Ingest: what lies in the inbox, and every new log of it taken in or refused."""

from datetime import date
from pathlib import Path

from prefect import task
from prefect.cache_policies import NO_CACHE
from prefect.logging import get_run_logger

from ses_core.settings import IngestSettings
from storage.artifact_store import LocalArtifactStore
from storage.inbox import Candidate, InboxScan, scan_inbox
from storage.inbox_ledger import InboxLedger
from storage.ingestion import TakenIn, take_in, take_in_again
from storage.log_decoder import DECODER_VERSION
from storage.quarantine import Quarantine, QuarantinedLog
from storage.table_log import TableLog
from tasks.outcome import conclude


@task(name="look through the inbox", cache_policy=NO_CACHE)
def look_through_inbox(
    inbox: Path, *, store: LocalArtifactStore, settings: IngestSettings
) -> InboxScan:
    """Tell new uploads from known ones, waiting for what may still be arriving."""
    return scan_inbox(
        inbox,
        ledger=InboxLedger(store.layout.ledger),
        settings=settings,
        progress=get_run_logger().info,
    )


@task(name="take in a log", task_run_name="take in {candidate.name}", cache_policy=NO_CACHE)
def ingest_log(
    candidate: Candidate,
    *,
    batch_date: date,
    store: LocalArtifactStore,
    tables: TableLog,
    settings: IngestSettings,
    anew: bool = False,
) -> TakenIn:
    """Decode one log in its limited child process and keep it, or refuse it with a reason."""
    taken = take_in(
        candidate,
        batch_date=batch_date,
        store=store,
        tables=tables,
        settings=settings,
        anew=anew,
    )
    get_run_logger().info("log %.12s: %s %s", taken.log_id, taken.status, taken.reason)
    return conclude(taken)


def refused_by_older_decoders(store: LocalArtifactStore) -> list[QuarantinedLog]:
    """List the logs in quarantine that this release may be able to read."""
    quarantine = Quarantine(store.layout.quarantine)
    return list(quarantine.worth_retrying(decoder_version=DECODER_VERSION))


@task(name="try a refused log again", cache_policy=NO_CACHE)
def retry_log(
    refused: QuarantinedLog,
    *,
    batch_date: date,
    store: LocalArtifactStore,
    tables: TableLog,
    settings: IngestSettings,
) -> TakenIn:
    """Decode a log from quarantine once more; it stays there if it is refused again."""
    return conclude(
        take_in_again(refused, batch_date=batch_date, store=store, tables=tables, settings=settings)
    )
