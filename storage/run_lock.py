"""`run_lock`: one night at a time on one store.

It saves work and confusion, no more: commits are correct without it.
"""

import fcntl
import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime

from ses_core.errors import SesError
from storage.durable_files import disk_errors
from storage.layout import Layout


class StoreBusyError(SesError):
    """Another process is working on the store; its text says which."""


@contextmanager
def run_lock(layout: Layout, *, purpose: str) -> Iterator[None]:
    """Hold the store's lock; the kernel frees it when its holder dies.

    Raises:
        StoreBusyError: Somebody else holds it; at once, without waiting.
    """
    with disk_errors(layout.lock_file):
        descriptor = os.open(layout.lock_file, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise StoreBusyError(
                f"store {layout.root} is in use by {_holder(descriptor)}: wait for it or stop it"
            ) from error
        holder = {
            "purpose": purpose,
            "process": os.getpid(),
            "host": socket.gethostname(),
            "since": datetime.now(UTC).isoformat(timespec="seconds"),
        }
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, json.dumps(holder).encode(), 0)
        yield
    finally:
        os.close(descriptor)


def lock_holder(layout: Layout) -> str | None:
    """Say who holds the store's lock, or None where nobody does."""
    try:
        descriptor = os.open(layout.lock_file, os.O_RDONLY)
    except FileNotFoundError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return _holder(descriptor)
    finally:
        os.close(descriptor)
    return None


def _holder(descriptor: int) -> str:
    try:
        holder = json.loads(os.pread(descriptor, 4096, 0))
        return (
            f"{holder['purpose']} (process {holder['process']} on {holder['host']}, "
            f"since {holder['since']})"
        )
    except (ValueError, KeyError, TypeError):
        # It got the lock a moment ago and has not said its name yet.
        return "another process"
