"""How much space is left, and a refusal before it runs out."""

import os
from pathlib import Path

from ses_core.errors import ArtifactError


def free_bytes(path: Path) -> int:
    """Count the bytes an ordinary user can still write where a path lies or would lie."""
    existing = path.absolute()
    while not existing.exists():
        existing = existing.parent
    status = os.statvfs(existing)
    return status.f_bavail * status.f_frsize


def require_free_space(path: Path, required: int) -> None:
    """Refuse to go on with less than the required bytes free.

    Raises:
        ArtifactError: There is less; names the path, what is free and what is required.
    """
    free = free_bytes(path)
    if free < required:
        raise ArtifactError(
            f"{path} has {free} bytes free, expected at least {required}: "
            "free some space or lower store.free_floor_mib"
        )
