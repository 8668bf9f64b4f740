"""The inbox: which uploads are new, known, still arriving, or none of ours; and claiming a copy.

An upload is one file, one folder with a `metadata.yaml` and its parts, or one folder of tables.
Nothing is ever parsed
under its uploaded name or in its uploaded place: `claim` copies it, while hashing, to a name of
our own.
"""

import os
import re
import stat
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ses_core.errors import ArtifactError
from ses_core.extraction.robot_matching import Identity, identify
from ses_core.recipes import digest_json
from ses_core.settings import IngestSettings
from storage.inbox_ledger import InboxLedger, LedgerEntry
from storage.log_formats import LOGS_FILE, MAP_FILE, SCANS_FILE, TRAJECTORIES_FILE

LOG_SUFFIXES: Final = (".bag", ".db3", ".mcap", ".log", ".clf", ".log.gz", ".clf.gz")
"""Names that say a file is meant as a log; everything else is passed over."""

METADATA: Final = "metadata.yaml"
PART_SUFFIXES: Final = (".db3", ".mcap", ".db3.zstd", ".mcap.zstd", ".db3-wal", ".db3-shm")
TABLE_MARKS: Final = frozenset((LOGS_FILE, SCANS_FILE, TRAJECTORIES_FILE))
"""A folder that holds all three is a log that comes as tables."""

TABLE_FILES: Final = (*sorted(TABLE_MARKS), MAP_FILE)
_DONE, _CHECKSUM = ".done", ".sha256"
_POLL_S = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """One upload.

    Attributes:
        path: The file or folder.
        relative: Its path below the inbox, with `/`: who uploaded it chose it.
        files: What belongs to it, sorted by name.
        fingerprint: Digest of names, sizes and times: changes whenever the upload does.
        newest_s: Time of the last change [s since 1970].
        is_complete: A sidecar says that the upload is over.
        checksum: The SHA-256 that came with it, or empty.
    """

    path: Path
    relative: str
    files: tuple[Path, ...]
    identity: Identity
    fingerprint: str
    bytes: int
    newest_s: float
    is_complete: bool
    checksum: str

    @property
    def name(self) -> str:
        """Name as uploaded."""
        return self.path.name


@dataclass(frozen=True, slots=True)
class KnownUpload:
    """An upload that an earlier night has dealt with."""

    candidate: Candidate
    entry: LedgerEntry


@dataclass(frozen=True, slots=True, kw_only=True)
class InboxScan:
    """What lies in the inbox.

    Attributes:
        waiting: Still arriving; left for the next night.
        ignored_count: Files that are no logs: hidden, temporary, sidecars, foreign names.
        unidentified_count: New logs without a robot or a site.
    """

    new: tuple[Candidate, ...]
    known: tuple[KnownUpload, ...]
    waiting: tuple[Candidate, ...]
    ignored_count: int
    unidentified_count: int


def scan_inbox(
    inbox: Path,
    *,
    ledger: InboxLedger,
    settings: IngestSettings,
    progress: Callable[[str], None],
    clock: Callable[[], float] = time.time,
    sleep: Callable[[float], None] = time.sleep,
) -> InboxScan:
    """Look through an inbox, waiting as long as the settings say for what is still arriving.

    An upload is over when a sidecar says so (`<name>.done`, or `<name>.sha256` with its
    checksum), or when nothing about it has changed for `steady_s`; younger ones are watched for
    that long and left for the next night when they still change.

    Args:
        inbox: Folder of uploads.
        ledger: What earlier nights have seen.
        settings: Identity, and how long an upload must have been steady.
        progress: Hears a line when there is something to wait for.
        clock: Time [s since 1970].
        sleep: Waits [s].

    Raises:
        ArtifactError: The inbox cannot be read.
    """
    candidates, ignored = _list(inbox, settings)
    known: list[KnownUpload] = []
    unseen: list[Candidate] = []
    for candidate in candidates:
        entry = ledger.find(candidate.fingerprint)
        if entry is None:
            unseen.append(candidate)
        else:
            known.append(KnownUpload(candidate, entry))
    young = [item for item in unseen if not _is_steady(item, settings, clock())]
    if young:
        progress(
            f"waiting up to {settings.steady_s:g} s for {len(young)} upload(s) that may still "
            "be arriving"
        )
        _wait(young, settings, clock=clock, sleep=sleep)
        before = {item.relative: item.fingerprint for item in unseen}
        again, ignored = _list(inbox, settings)
        unseen = [item for item in again if item.relative in before]
        waiting = [
            item
            for item in unseen
            if before[item.relative] != item.fingerprint and not item.is_complete
        ]
    else:
        waiting = []
    new = [item for item in unseen if item not in waiting]
    return InboxScan(
        new=tuple(new),
        known=tuple(known),
        waiting=tuple(waiting),
        ignored_count=ignored,
        unidentified_count=sum(not item.identity.is_complete for item in new),
    )


def _wait(
    young: list[Candidate],
    settings: IngestSettings,
    *,
    clock: Callable[[], float],
    sleep: Callable[[float], None],
) -> None:
    """Wait until the youngest upload would be old enough, if it stays as it is."""
    deadline = clock() + settings.steady_s
    # A time stamp from the future must not make us wait longer than asked.
    ready = min(deadline, max(item.newest_s for item in young) + settings.steady_s)
    while (left := ready - clock()) > 0:
        sleep(min(left, _POLL_S))


def _is_steady(candidate: Candidate, settings: IngestSettings, now: float) -> bool:
    return candidate.is_complete or now - candidate.newest_s >= settings.steady_s


def _list(inbox: Path, settings: IngestSettings) -> tuple[list[Candidate], int]:
    """Give every upload below a folder, in order of name, and how many other files there are."""
    candidates: list[Candidate] = []
    ignored = 0
    for folder, names in _walk(inbox):
        if METADATA in names or set(names) >= TABLE_MARKS:
            parts = [name for name in names if _is_part(name, is_table=METADATA not in names)]
            candidate = _candidate(inbox, folder, tuple(folder / name for name in parts), settings)
            ignored += len(names) - len(parts)
            candidates.extend([candidate] if candidate else [])
            continue
        for name in names:
            path = folder / name
            if not name.lower().endswith(LOG_SUFFIXES):
                ignored += not name.endswith((".db3-wal", ".db3-shm"))
                continue
            files = (path, *_write_ahead_files(path, names))
            candidate = _candidate(inbox, path, files, settings)
            candidates.extend([candidate] if candidate else [])
    return sorted(candidates, key=lambda item: item.relative), ignored


def _is_part(name: str, *, is_table: bool) -> bool:
    if is_table:
        return name in TABLE_FILES
    return name == METADATA or name.endswith(PART_SUFFIXES)


def _walk(inbox: Path) -> Iterator[tuple[Path, list[str]]]:
    """Give every folder with what it holds beside folders; a link to one is no folder."""
    folders = [inbox]
    while folders:
        folder = folders.pop()
        names: list[str] = []
        try:
            with os.scandir(folder) as entries:
                for entry in entries:
                    if entry.name.startswith("."):
                        continue
                    if entry.is_dir(follow_symlinks=False):
                        folders.append(folder / entry.name)
                    else:
                        names.append(entry.name)
        except OSError as error:
            raise ArtifactError(f"inbox {inbox} cannot be read: {error}") from error
        yield folder, sorted(names)


def _write_ahead_files(path: Path, names: list[str]) -> tuple[Path, ...]:
    beside = (f"{path.name}-shm", f"{path.name}-wal")
    return tuple(path.with_name(name) for name in beside if name in names)


def _candidate(
    inbox: Path, path: Path, files: tuple[Path, ...], settings: IngestSettings
) -> Candidate | None:
    """Describe an upload from what the file system says of it; None where it has just gone."""
    relative = path.relative_to(inbox).as_posix()
    try:
        stats = [(file.name, os.lstat(file)) for file in files]
    except FileNotFoundError:
        return None
    checksum_file = path.with_name(f"{path.name}{_CHECKSUM}")
    checksum = _read_checksum(checksum_file)
    described = [[name, found.st_size, found.st_mtime_ns] for name, found in stats]
    return Candidate(
        path=path,
        relative=relative,
        files=files,
        identity=identify(relative, settings),
        # Undecodable bytes in a name come as surrogates, which JSON writes but UTF-8 refuses.
        fingerprint=digest_json([ascii(relative), ascii(described), checksum]),
        bytes=sum(found.st_size for _, found in stats if stat.S_ISREG(found.st_mode)),
        newest_s=max(found.st_mtime for _, found in stats),
        is_complete=bool(checksum) or path.with_name(f"{path.name}{_DONE}").exists(),
        checksum=checksum,
    )


def _read_checksum(path: Path) -> str:
    """Read the first word of a checksum file: 64 hexadecimal digits, or it is none."""
    try:
        with path.open("rb") as file:
            words = file.read(200).decode("ascii", errors="replace").split()
    except OSError:
        return ""
    found = words[0].lower() if words else ""
    return found if re.fullmatch(r"[0-9a-f]{64}", found) else ""
