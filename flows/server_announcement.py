"""How commands find the server of `ses serve`: a locked file beside Prefect's database."""

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from flows.prefect_environment import ServerAddress, prefect_home
from ses_core.errors import SettingsError


@dataclass(frozen=True, slots=True, kw_only=True)
class Announcement:
    """A server that is there for whoever works on the same root."""

    address: ServerAddress
    has_password: bool


def announced_server(root: Path) -> Announcement | None:
    """Give the server of the `ses serve` that runs for a root, or None."""
    try:
        descriptor = os.open(_path(root), os.O_RDONLY)
    except FileNotFoundError:
        return None
    with os.fdopen(descriptor) as file:
        # The kernel drops the lock with its holder, however that ended: what nobody locks is stale.
        if _lock(file.fileno(), fcntl.LOCK_SH):
            return None
        text = file.read()
    if not text:
        return None
    found = json.loads(text)
    address = ServerAddress(host=found["host"], port=found["port"])
    return Announcement(address=address, has_password=found["has_password"])


@contextmanager
def the_only_one(root: Path) -> Iterator[int]:
    """Be the one `ses serve` of a root; gives the descriptor that `announce` writes to.

    Raises:
        SettingsError: Another one runs.
    """
    descriptor = os.open(_path(root), os.O_RDWR | os.O_CREAT, 0o600)
    try:
        if not _lock(descriptor, fcntl.LOCK_EX):
            running = announced_server(root)
            where = running.address.url if running else "an address of its own"
            raise SettingsError(
                f"root {root} is served already on {where}, expected a root without `ses serve`"
            )
        os.ftruncate(descriptor, 0)
        yield descriptor
    finally:
        os.close(descriptor)


def announce(descriptor: int, announcement: Announcement) -> None:
    """Let commands on the same root find a server; it must answer already."""
    address = announcement.address
    found = {
        "host": address.host,
        "port": address.port,
        "has_password": announcement.has_password,
    }
    os.pwrite(descriptor, json.dumps(found).encode(), 0)


def _path(root: Path) -> Path:
    return prefect_home(root) / "serving.json"


def _lock(descriptor: int, kind: int) -> bool:
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
