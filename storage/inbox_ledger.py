"""`InboxLedger`: what is known of uploads, so that a known log is recognised without reading it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ses_core.errors import ArtifactError
from storage.durable_files import disk_errors, replace_file

LogStatus = Literal["taken", "quarantined"]


@dataclass(frozen=True, slots=True)
class LedgerEntry:
    """What became of a log: taken, or quarantined for a reason."""

    log_id: str
    status: LogStatus
    reason: str = ""


class InboxLedger:
    """Two small maps of files: fingerprint of an upload -> log, and log -> what became of it.

    A fingerprint comes from names, sizes and times alone; it stands for bytes that were read
    once. Entries are whole or absent, and an unreadable one only means reading a log again.
    """

    def __init__(self, folder: Path) -> None:
        self._uploads = folder / "uploads"
        self._logs = folder / "logs"

    def find(self, fingerprint: str) -> LedgerEntry | None:
        """Tell what became of an upload; None if it is not known."""
        known = _read(self._uploads / f"{fingerprint}.json")
        return None if known is None else self.status(str(known.get("log_id")))

    def status(self, log_id: str) -> LedgerEntry | None:
        """Tell what became of a log; None if it is not known."""
        known = _read(self._logs / f"{log_id}.json")
        if known is None:
            return None
        status: LogStatus = "quarantined" if known.get("status") == "quarantined" else "taken"
        return LedgerEntry(log_id, status, str(known.get("reason", "")))

    def record(self, fingerprint: str, entry: LedgerEntry) -> None:
        """Remember what became of an upload, once that is on the disk.

        Raises:
            ArtifactError: The disk is full or failing.
        """
        outcome = {"log_id": entry.log_id, "status": entry.status, "reason": entry.reason}
        replace_file(self._logs / f"{entry.log_id}.json", json.dumps(outcome).encode())
        upload = {"log_id": entry.log_id}
        replace_file(self._uploads / f"{fingerprint}.json", json.dumps(upload).encode())

    def forget(self, log_id: str) -> None:
        """Forget a log, so that the next scan finds it new."""
        path = self._logs / f"{log_id}.json"
        with disk_errors(path):
            path.unlink(missing_ok=True)


def _read(path: Path) -> Mapping[str, object] | None:
    try:
        content = json.loads(path.read_bytes())
    except (FileNotFoundError, ValueError):
        return None
    except OSError as error:
        raise ArtifactError(f"{path} cannot be read: {error}") from error
    return content if isinstance(content, dict) else None
