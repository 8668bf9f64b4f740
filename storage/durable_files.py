"""Files that are whole or absent: synced before they get their name, linked only if absent."""

import errno
import os
import secrets
from collections.abc import Container, Iterator
from contextlib import contextmanager
from pathlib import Path

from ses_core.errors import ArtifactError
from storage.disk_space import free_bytes

MACHINE_FAULTS = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.EFBIG})
"""What the operating system reports when this machine is to blame, never the data."""

_TEMPORARY_SUFFIX = ".part"


@contextmanager
def disk_errors(path: Path, *, only: Container[int] | None = None) -> Iterator[None]:
    """Turn a fault of the disk into an error that names the path and the space left.

    Args:
        path: Named where the operating system names no file.
        only: Error numbers to turn; all of them by default.

    Raises:
        ArtifactError: What the operating system reported inside the block.
    """
    try:
        yield
    except OSError as error:
        if only is not None and error.errno not in only:
            raise
        where = error.filename if isinstance(error.filename, str) else path
        reason = error.strerror or str(error) or type(error).__name__
        raise ArtifactError(
            f"{where}: {reason[0].lower()}{reason[1:]} ({free_bytes(path)} bytes free)"
        ) from error


def make_folder(folder: Path) -> None:
    """Make a folder and those above it, each on the disk before anything lies in it."""
    if folder.is_dir():
        return
    make_folder(folder.parent)
    folder.mkdir(exist_ok=True)
    sync_folder(folder.parent)


def temporary_name(path: Path) -> Path:
    """Give a hidden name beside a path that says which process is writing it."""
    return path.with_name(f".{path.name}.{os.getpid()}.{secrets.token_hex(4)}{_TEMPORARY_SUFFIX}")


def temporary_owner(path: Path) -> int | None:
    """Tell which process wrote a temporary file or folder; None for any other name."""
    pieces = path.name.rsplit(".", 3)
    if path.name.startswith(".") and len(pieces) == 4 and pieces[3] == _TEMPORARY_SUFFIX[1:]:
        return int(pieces[1]) if pieces[1].isdigit() else None
    return None


def write_if_absent(path: Path, content: bytes) -> bool:
    """Put a file in place in one step, unless the name is taken.

    Rename would replace what another writer has just committed; a hard link cannot.

    Returns:
        Whether the file now has this content; False where it has other content.

    Raises:
        ArtifactError: The disk is full or failing.
    """
    with disk_errors(path):
        make_folder(path.parent)
        temporary = temporary_name(path)
        try:
            _write_synced(temporary, content)
            try:
                os.link(temporary, path)
            except FileExistsError:
                return path.read_bytes() == content
        finally:
            temporary.unlink(missing_ok=True)
        sync_folder(path.parent)
    return True


def replace_file(path: Path, content: bytes) -> None:
    """Put a file in place in one step, whatever was there before.

    Raises:
        ArtifactError: The disk is full or failing; what was there is still there.
    """
    with disk_errors(path):
        make_folder(path.parent)
        temporary = temporary_name(path)
        try:
            _write_synced(temporary, content)
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
        sync_folder(path.parent)


def sync_file(path: Path) -> None:
    """Wait until a file's content is on the disk."""
    _sync(path, os.O_RDONLY)


def sync_folder(folder: Path) -> None:
    """Wait until a folder's entries are on the disk."""
    _sync(folder, os.O_RDONLY | os.O_DIRECTORY)


def _write_synced(path: Path, content: bytes) -> None:
    with path.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _sync(path: Path, flags: int) -> None:
    descriptor = os.open(path, flags)
    try:
        os.fsync(descriptor)
    except OSError as error:
        # Some network file systems cannot sync a folder; they order its entries themselves.
        if error.errno != errno.EINVAL:
            raise
    finally:
        os.close(descriptor)
