"""Refused logs: each kept whole, with one reason from a closed list."""

import json
import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Final

from ses_core.errors import ArtifactError, LogError
from storage.durable_files import disk_errors, replace_file, sync_folder

REASONS: Final = {
    "truncated": "the file ends early or is damaged inside",
    "bad_magic": "the file is none of the known formats, whatever its name says",
    "checksum": "the content differs from the checksum that came with it",
    "decompress_bomb": "compressed content inflates beyond any real recording",
    "time_limit": "decoding took longer than allowed",
    "memory_limit": "decoding needed more memory, or a message was larger, than allowed",
    "size_limit": "the log is larger than allowed",
    "unknown_definition": "a topic we need has another message definition than ROS gives its type",
    "missing_topic": "nothing in the log says where the robot was",
    "bad_clock": "most stamps are impossible or all the same",
    "bad_values": "most poses are not numbers or out of reach",
    "missing_metadata": "the metadata.yaml that the recording needs is absent or unusable",
    "schema_conflict": "messages do not have the form their type says",
    "empty": "the file or recording holds nothing",
    "unsupported": "a link, an encrypted or foreign recording, or a database with programs in it",
    "decoder_bug": "the decoder failed in a way that is our fault; please report it",
}
"""Every reason a log is refused for, with what it means."""

_MESSAGE_LIMIT = 500
_NAME_LIMIT = 300


@dataclass(frozen=True, slots=True, kw_only=True)
class QuarantinedLog:
    """One refused log.

    Attributes:
        log_id: Digest of its content, or of its name where there was no content to keep.
        relative: Path below the inbox as uploaded: data, never a path of ours.
        payload: The spooled copy; None where nothing could be kept (links, empty files).
        decoder_version: Of the decoder that refused it; a newer one may try again.
    """

    log_id: str
    batch_date: date
    reason: str
    message: str
    relative: str
    site: str
    robot: str
    format: str
    decoder_version: int
    payload: Path | None


def printable(text: str, limit: int = _NAME_LIMIT) -> str:
    """Make text from a log or a file name fit for a terminal, a page and a line."""
    return re.sub(r"[^\x20-\x7e\xa0-\uffff]", "\N{REPLACEMENT CHARACTER}", text)[:limit]


class Quarantine:
    """The folder of refused logs: `<date>/<log_id>/{reason.json, payload...}`."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def put(
        self,
        error: LogError,
        *,
        log_id: str,
        batch_date: date,
        relative: str,
        site: str,
        robot: str,
        format: str,  # noqa: A002 - the contract's word
        decoder_version: int,
        payload: Path | None,
    ) -> QuarantinedLog:
        """Keep a refused log; its spooled copy is moved here.

        Raises:
            ArtifactError: The disk is full or failing.
        """
        reason = error.reason if error.reason in REASONS else "decoder_bug"
        folder = self._folder / batch_date.isoformat() / log_id
        record = {
            "log_id": log_id,
            "batch_date": batch_date.isoformat(),
            "reason": reason,
            "meaning": REASONS[reason],
            "message": printable(str(error), _MESSAGE_LIMIT),
            "relative": printable(relative),
            "site": printable(site),
            "robot": printable(robot),
            "format": format,
            "decoder_version": decoder_version,
        }
        with disk_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)
            if payload is not None and payload.exists():
                kept = folder / f"payload{payload.suffix}"
                if kept.exists():
                    _remove(payload)
                else:
                    shutil.move(payload, kept)
                    sync_folder(folder)
        # The record comes last: a folder without one is an interrupted move and is not listed.
        replace_file(folder / "reason.json", (json.dumps(record, indent=1) + "\n").encode())
        return _read(folder)

    def entries(self) -> list[QuarantinedLog]:
        """Give every refused log, by date and id."""
        return [_read(path.parent) for path in sorted(self._folder.glob("*/*/reason.json"))]

    def find(self, log_id: str) -> QuarantinedLog:
        """Find a refused log by its id or the beginning of it; of several days the last.

        Raises:
            ArtifactError: None, or several logs, begin like this.
        """
        found = [entry for entry in self.entries() if entry.log_id.startswith(log_id)]
        if len({entry.log_id for entry in found}) != 1 or not log_id:
            raise ArtifactError(
                f"{len(found)} logs in quarantine have an id that begins with "
                f"{printable(log_id, 64)!r}, expected one"
            )
        return found[-1]

    def release(self, log_id: str) -> None:
        """Forget a log that was taken after all."""
        for path in self._folder.glob(f"*/{log_id}"):
            _remove(path)

    def worth_retrying(self, *, decoder_version: int) -> Sequence[QuarantinedLog]:
        """Give the logs that an older decoder refused and whose content was kept."""
        return [
            entry
            for entry in self.entries()
            if entry.payload is not None and entry.decoder_version < decoder_version
        ]


def _read(folder: Path) -> QuarantinedLog:
    path = folder / "reason.json"
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        payload = next((child for child in folder.iterdir() if child.stem == "payload"), None)
        return QuarantinedLog(
            log_id=str(record["log_id"]),
            batch_date=date.fromisoformat(record["batch_date"]),
            reason=str(record["reason"]),
            message=str(record["message"]),
            relative=str(record["relative"]),
            site=str(record["site"]),
            robot=str(record["robot"]),
            format=str(record["format"]),
            decoder_version=int(record["decoder_version"]),
            payload=payload,
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ArtifactError(f"{path} is damaged: {error}") from error


def _remove(path: Path) -> None:
    with disk_errors(path):
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
