"""The logs that the store holds: where each one's trajectories are, and since which batch."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import date

from ses_core.recipes import ArtifactRef
from storage.table_log import TableLog


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogueEntry:
    """One log that was taken in; `ref` is the artifact with its trajectories."""

    log_id: str
    batch_date: date
    ref: ArtifactRef


def catalogue(log: TableLog) -> list[CatalogueEntry]:
    """List the logs of a store, by batch and then by identity.

    The table of trajectories has one part per log in its batch's folder, so nothing is read.
    """
    entries = [
        CatalogueEntry(log_id=part.name, batch_date=date.fromisoformat(part.folder), ref=part.ref)
        for part in log.parts("trajectories")
    ]
    return sorted(entries, key=lambda entry: (entry.batch_date, entry.log_id))


def last_batch(entries: Iterable[CatalogueEntry]) -> date | None:
    """Give the day of the newest batch; None where no log was ever taken in."""
    return max((entry.batch_date for entry in entries), default=None)
