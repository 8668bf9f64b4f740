"""Claiming an upload: a copy under a name of our own, hashed while it is copied."""

import errno
import hashlib
import os
import shutil
import stat
from dataclasses import dataclass
from pathlib import Path

from ses_core.errors import LogError
from ses_core.recipes import digest_json
from storage.durable_files import disk_errors, temporary_name
from storage.inbox import METADATA, TABLE_FILES, Candidate
from storage.log_formats import (
    CARMEN,
    ROSBAG1,
    ROSBAG2_MCAP,
    ROSBAG2_SQLITE,
    SUFFIXES,
    TABLES,
    ZSTD_MAGIC,
    detect_format,
)

_BLOCK = 2**20
_WRITE_BITS = 0o222
_PARQUET_MAGIC, _ZIP_MAGIC = b"PAR1", b"PK\x03\x04"


@dataclass(frozen=True, slots=True)
class ClaimedLog:
    """A private copy of an upload.

    Attributes:
        log_id: Digest of the content: the same log has it under any name.
        payload: File or folder of our own, named by the digest.
        format: One of `storage.log_formats`.
    """

    log_id: str
    payload: Path
    format: str


class RefusedClaimError(LogError):
    """An upload refused before it was decoded; knows its id, and what was kept of it."""

    def __init__(self, reason: str, message: str, *, log_id: str, payload: Path | None) -> None:
        super().__init__(reason, message)
        self.log_id = log_id
        self.payload = payload


def claim(candidate: Candidate, *, staging: Path) -> ClaimedLog:
    """Copy an upload into the spool and tell what it is.

    Raises:
        RefusedClaimError: It is a link, empty, of no known format, or not what its checksum says.
        ArtifactError: The disk is full or failing.
    """
    with disk_errors(staging):
        staging.mkdir(parents=True, exist_ok=True)
        folder = temporary_name(staging / "claim")
        folder.mkdir()
        try:
            return _claim(candidate, folder, staging)
        finally:
            shutil.rmtree(folder, ignore_errors=True)


def _claim(candidate: Candidate, folder: Path, staging: Path) -> ClaimedLog:
    roles = {file: _role(file) for file in candidate.files}
    digests: list[list[str]] = []
    for number, (file, role) in enumerate(roles.items()):
        if role == "-shm":
            continue
        digests.append([role, _copy(file, folder / _own_name(number, role, roles), candidate)])
    is_single = len(digests) == 1 and digests[0][0] != METADATA
    log_id = digests[0][1] if is_single else digest_json(sorted(digests))
    copies = sorted(path for path in folder.iterdir() if path.name != METADATA)
    found = _format(copies)
    if is_single:
        (copy,) = folder.iterdir()
        payload = _settle(copy, staging / f"{log_id}{SUFFIXES.get(found or '', '.log')}")
    else:
        payload = _settle(folder, staging / log_id)
    if candidate.checksum and candidate.checksum != log_id:
        reason, message = "checksum", f"SHA-256 is {log_id}, expected {candidate.checksum}"
    elif candidate.bytes == 0:
        reason, message = "empty", "file holds nothing"
    elif found is None:
        reason, message = "bad_magic", "first bytes are those of no known format"
    else:
        return ClaimedLog(log_id, payload, found)
    raise RefusedClaimError(reason, message, log_id=log_id, payload=payload)


def _role(file: Path) -> str:
    """Say what a file is within its upload; two uploads are the same log if these agree."""
    if file.name == METADATA or file.name in TABLE_FILES:
        return file.name
    if file.name.endswith(("-wal", "-shm")):
        return file.name[-4:]
    return ".db3" if ".db3" in file.name else ".mcap" if ".mcap" in file.name else ".log"


def _own_name(number: int, role: str, roles: dict[Path, str]) -> str:
    """Name a copy; a write-ahead log is named after its database, as SQLite expects."""
    if role == METADATA or role in TABLE_FILES:
        return role
    if role != "-wal":
        return f"part-{number:04d}{role}"
    log = list(roles)[number]
    database = log.with_name(log.name.removesuffix("-wal"))
    owner = list(roles).index(database) if database in roles else number
    return f"part-{owner:04d}{roles.get(database, '.db3')}-wal"


def _copy(file: Path, copy: Path, candidate: Candidate) -> str:
    """Copy a regular file nobody else writes to, and give its SHA-256."""
    try:
        descriptor = os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError as error:
        if error.errno in (errno.ELOOP, errno.ENXIO, errno.ENOENT):
            raise _refused(candidate, f"{type(error).__name__}: no regular file") from error
        raise
    with os.fdopen(descriptor, "rb") as source, copy.open("xb") as target:
        before = os.fstat(source.fileno())
        # A second name lets someone else change what we read; nobody writes to a read-only
        # file, so that archives kept as hard links stay usable.
        is_shared = before.st_nlink > 1 and bool(before.st_mode & _WRITE_BITS)
        if not stat.S_ISREG(before.st_mode) or is_shared:
            raise _refused(candidate, "file is no regular file with a single name")
        digest = hashlib.sha256()
        while block := source.read(_BLOCK):
            digest.update(block)
            target.write(block)
        after = os.fstat(source.fileno())
    if (before.st_size, before.st_mtime_ns) != (after.st_size, after.st_mtime_ns):
        raise _refused(candidate, "file changed while it was read", reason="truncated")
    return digest.hexdigest()


def _refused(
    candidate: Candidate, message: str, *, reason: str = "unsupported"
) -> RefusedClaimError:
    # Without content of its own a refusal is known by what the upload looked like.
    return RefusedClaimError(reason, message, log_id=candidate.fingerprint, payload=None)


def _format(copies: list[Path]) -> str | None:
    """Tell the one format of all parts; compressed parts are given their suffix on the way."""
    if any(copy.name in TABLE_FILES for copy in copies):
        return TABLES if all(_is_table_file(copy) for copy in copies) else None
    found: set[str | None] = set()
    for copy in copies:
        if copy.name.endswith("-wal"):
            continue
        with copy.open("rb") as file:
            is_compressed = file.read(len(ZSTD_MAGIC)) == ZSTD_MAGIC
        if is_compressed and copy.suffix in (".db3", ".mcap"):
            found.add(ROSBAG2_SQLITE if copy.suffix == ".db3" else ROSBAG2_MCAP)
            copy.rename(copy.with_name(f"{copy.name}.zst"))
            continue
        name = detect_format(copy)
        found.add(name)
        if name in (ROSBAG2_SQLITE, ROSBAG2_MCAP) and copy.suffix != SUFFIXES[name]:
            copy.rename(copy.with_suffix(SUFFIXES[name]))
    is_folder = len(copies) > 1
    if len(found) != 1 or (is_folder and found & {ROSBAG1, CARMEN}):
        return None
    return found.pop()


def _is_table_file(copy: Path) -> bool:
    with copy.open("rb") as file:
        return file.read(4) in (_PARQUET_MAGIC, _ZIP_MAGIC)


def _settle(copy: Path, payload: Path) -> Path:
    """Give a copy its place; the same bytes may lie there already."""
    if payload.is_dir():
        shutil.rmtree(payload)
    copy.replace(payload)
    return payload
