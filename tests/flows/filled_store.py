"""A store as a night leaves it: one log taken in and cut, another refused."""

from datetime import date
from pathlib import Path

from ses_core.settings import IngestSettings, Settings
from storage.artifact_store import LocalArtifactStore
from storage.bag_messages import BagContent
from storage.inbox import scan_inbox
from storage.inbox_ledger import InboxLedger
from storage.ingestion import take_in
from storage.log_catalogue import catalogue
from storage.table_log import TableLog
from tasks.extract import extract_scenarios
from tests.log_factory import drive, write_log

DAY = date(2026, 11, 22)


def fill_store(root: Path, inbox: Path, content: BagContent | None = None) -> LocalArtifactStore:
    """Fill a store with a log; the one by default has a map that shows nothing of its places."""
    folder = inbox / "office" / "r07"
    folder.mkdir(parents=True)
    write_log(folder, "bag", content or drive(40.0, speed=0.5))
    (folder / "torn.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(200))
    store = LocalArtifactStore(root)
    settings = Settings(ingest=IngestSettings(steady_s=0.0))
    scan = scan_inbox(
        inbox,
        ledger=InboxLedger(store.layout.ledger),
        settings=settings.ingest,
        progress=lambda _: None,
    )
    tables = TableLog(store.layout)
    for candidate in scan.new:
        take_in(candidate, batch_date=DAY, store=store, tables=tables, settings=settings.ingest)
    for log in catalogue(tables):
        extract_scenarios.fn(log, store=store, tables=tables, settings=settings)
    return store
