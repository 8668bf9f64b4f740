"""`collect_garbage`: what nobody needs any more goes, beside readers and writers.

Gone are: what dead processes left half-built, artifacts that no recipe, table, or champion
leads to, answers of disposable or outdated stages that were long not asked for, and scans
older than their retention. Whoever asks for a collected artifact misses it and builds it
again.
"""

import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from ses_core.errors import ArtifactError
from ses_core.recipes import ArtifactRef
from ses_core.settings import StoreSettings
from storage.artifact_store import read_answer
from storage.durable_files import disk_errors, temporary_name, temporary_owner
from storage.file_lock import file_lock
from storage.layout import Layout
from storage.object_files import drop_files
from storage.policy_registry import PolicyRegistry
from storage.stages import DISPOSABLE_STAGES, STAGES
from storage.table_log import TableLog

GRACE = timedelta(days=1)
"""Younger than this, an artifact without recipe may be one that is just being committed."""

_MAX_TEMPORARY_AGE = timedelta(days=1)
"""Older than this, a temporary is garbage even if its process's number is in use again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Collected:
    """What one collection took away.

    Attributes:
        temporaries: Half-built files and folders.
        recipes: Answers that were long not asked for.
        objects: Artifacts that nothing led to.
        scan_parts: Parts of `scans` older than the retention.
        freed_bytes: What all that took on the disk.
    """

    temporaries: int
    recipes: int
    objects: int
    scan_parts: int
    freed_bytes: int


def collect_garbage(
    layout: Layout, *, now: datetime, keep: StoreSettings, grace: timedelta = GRACE
) -> Collected:
    """Take away what nobody needs any more.

    Args:
        layout: The store.
        now: Today, with its time zone.
        keep: For how long scans and disposable artifacts are kept.
        grace: Age below which an artifact is left alone whatever leads to it.

    Raises:
        ArtifactError: The table log or the registry is damaged: nothing is taken away then.
    """
    with disk_errors(layout.root):
        # Both are read before anything goes: without them, everything would look unneeded.
        log = TableLog(layout)
        champions = {entry.policy for entry in PolicyRegistry(layout).history() if entry.policy}
        temporaries, temporary_bytes = _sweep_temporaries(layout, now)
        scan_parts, scan_bytes = _drop_scans(layout, log, now, keep)
        recipes, answered = _sweep_recipes(layout, now, keep, champions)
        needed = answered | champions | {part.ref for part in log.all_parts()}
        objects, object_bytes = _sweep_objects(layout, needed, now - grace)
    return Collected(
        temporaries=temporaries,
        recipes=recipes,
        objects=objects,
        scan_parts=scan_parts,
        freed_bytes=temporary_bytes + scan_bytes + object_bytes,
    )


def stray_temporaries(layout: Layout, now: datetime) -> Iterator[Path]:
    """Find what dead processes left half-built."""
    for walked, names, files in os.walk(layout.root):
        if Path(walked) in (layout.objects, layout.corrupt, layout.prefect):
            names.clear()
        yield from (path for name in [*names, *files] if _is_stray(path := Path(walked, name), now))
        # What lies in a half-built folder goes with it.
        names[:] = [name for name in names if temporary_owner(Path(name)) is None]
    # Artifacts are not walked: only their own notes are ever written again.
    yield from (path for path in layout.objects.glob("*/*/.*") if _is_stray(path, now))
    for folder in (layout.staging, layout.temporary):
        for path in folder.glob("*"):
            if temporary_owner(path) is None and _age(path, now) > _MAX_TEMPORARY_AGE:
                yield path


def _is_stray(path: Path, now: datetime) -> bool:
    owner = temporary_owner(path)
    return owner is not None and (not _is_alive(owner) or _age(path, now) > _MAX_TEMPORARY_AGE)


def _sweep_temporaries(layout: Layout, now: datetime) -> tuple[int, int]:
    paths = list(stray_temporaries(layout, now))
    freed = sum(map(_remove, paths))
    return len(paths), freed


def _drop_scans(
    layout: Layout, log: TableLog, now: datetime, keep: StoreSettings
) -> tuple[int, int]:
    """Give up the scans of batches older than the retention.

    Files go before the log says so: killed in between, the next collection finds them listed
    and ends the work; readers pass over a file that was dropped.
    """
    oldest = (now - timedelta(days=keep.scan_retention_days)).date().isoformat()
    old = [part for part in log.parts("scans") if part.folder < oldest]
    for part in old:
        folder = layout.object_folder(part.ref)
        if folder.is_dir():
            drop_files(folder, [part.file])
    if old:
        log.commit([], old, message=f"drop scans of batches before {oldest}")
    return len(old), sum(part.size for part in old)


def _sweep_recipes(
    layout: Layout, now: datetime, keep: StoreSettings, champions: set[ArtifactRef]
) -> tuple[int, set[ArtifactRef]]:
    """Forget long unused answers of disposable stages and of outdated versions.

    Returns:
        How many were forgotten, and the artifacts that the others lead to.
    """
    current = {stage.name: stage.version for stage in STAGES}
    disposable = {stage.name for stage in DISPOSABLE_STAGES}
    retention = timedelta(days=keep.artifact_retention_days)
    forgotten = 0
    answered: set[ArtifactRef] = set()
    for path in layout.recipes.glob("*/*.json"):
        try:
            answer = read_answer(path)
        except ArtifactError:
            continue  # Damaged: `verify` finds it, and the next night writes it anew.
        stage = path.parent.name
        is_outdated = answer.recipe["version"] != current.get(stage)
        is_unused = _age(path, now) > retention and answer.ref not in champions
        if is_unused and (is_outdated or stage in disposable):
            path.unlink(missing_ok=True)
            forgotten += 1
        else:
            answered.add(answer.ref)
    return forgotten, answered


def _sweep_objects(layout: Layout, needed: set[ArtifactRef], before: datetime) -> tuple[int, int]:
    count = freed = 0
    for folder in layout.objects.glob("*/*"):
        ref = ArtifactRef(folder.parent.name, folder.name)
        if ref in needed or not _is_older(folder, before):
            continue
        hidden = temporary_name(layout.staging / ref.digest)
        # A writer that makes the same artifact anew makes it young under this lock.
        with file_lock(layout.sweep_lock):
            if not _is_older(folder, before):
                continue
            folder.rename(hidden)
        freed += _remove(hidden)
        count += 1
    return count, freed


def _is_older(path: Path, before: datetime) -> bool:
    try:
        return path.stat().st_mtime < before.timestamp()
    except FileNotFoundError:
        return False


def _age(path: Path, now: datetime) -> timedelta:
    try:
        return timedelta(seconds=now.timestamp() - path.stat().st_mtime)
    except FileNotFoundError:
        return timedelta(0)


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _remove(path: Path) -> int:
    """Remove a file or folder.

    Returns:
        Bytes of its files that no other name leads to.
    """
    files = [path] if path.is_file() else [file for file in path.rglob("*") if file.is_file()]
    freed = sum(status.st_size for status in map(os.lstat, files) if status.st_nlink == 1)
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
    return freed
