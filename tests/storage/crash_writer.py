"""Runs a night's commits over and over, each time stopped at another call to the disk.

`python -m tests.storage.crash_writer FATE WORK FOLDER STRIDE` makes a store, counts the calls
that one workload makes, then for every STRIDE-th n runs it on a copy of the store where call n
meets its fate, checks what is left, runs it again undisturbed and compares. Every run is a
process of its own. Prints one JSON value per run.
"""

import errno
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from datetime import UTC, date, datetime
from pathlib import Path

import pandas as pd
import pyarrow.dataset  # noqa: F401  (pandas imports it late: once here, not in every run)

from ses_core.errors import ArtifactError
from ses_core.settings import StoreSettings
from storage.artifact_store import LocalArtifactStore, read_answer
from storage.batch_manifest import RunRecord, read_manifest, record_run
from storage.garbage_collection import collect_garbage
from storage.parquet_files import row_count
from storage.policy_registry import PolicyRegistry
from storage.table_log import TableLog
from storage.table_parts import artifact_parts
from storage.verification import Damage, verify
from tests.storage.sample_tables import build_of, commit_sample, recipe_of

CALLS = ("fsync", "link", "rename", "replace", "unlink", "mkdir")
TABLES = ("logs", "scans")
OLD_DAY, DAY = date(2026, 1, 1), date(2026, 11, 22)

Fate = Callable[[int, str], None]


def prepare(root: Path) -> None:
    """Make the store that every run starts from: one log, long taken in."""
    store = LocalArtifactStore(root)
    commit_sample(store, TableLog(store.layout), "a", day=OLD_DAY, tables=TABLES)


def night(root: Path) -> None:
    """Take in one new log, replace the rows of the old one, promote, write the manifest."""
    store = LocalArtifactStore(root)
    log = TableLog(store.layout)
    commit_sample(store, log, "b", day=DAY, tables=TABLES)
    again = store.put(recipe_of("c"), build_of("c", day=OLD_DAY, tables=TABLES))
    log.commit(artifact_parts(store, again, name="a", batch_date=OLD_DAY), message="anew")
    PolicyRegistry(store.layout).promote(again, policy_id="p", run_id="r", reason="test")
    run = RunRecord(
        run_id="r",
        started_stamp_ns=0,
        seconds=1.0,
        logs=(),
        stages=(),
        decision="",
        champion="p",
        summary={},
    )
    record_run(store.layout, DAY, run)


def collection(root: Path) -> None:
    """Give up the scans of the old log."""
    store = LocalArtifactStore(root)
    collect_garbage(store.layout, now=datetime(2026, 11, 22, tzinfo=UTC), keep=StoreSettings())


WORKLOADS = {"night": night, "collection": collection}


def kill_before(n: int) -> Fate:
    def fate(number: int, name: str) -> None:
        if number == n:
            os.kill(os.getpid(), signal.SIGKILL)

    return fate


def fail(n: int, code: int, *, persistent: bool) -> Fate:
    def fate(number: int, name: str) -> None:
        if number == n or (persistent and number > n):
            raise OSError(code, os.strerror(code))

    return fate


FATES: dict[str, Callable[[int], Fate]] = {
    "kill": kill_before,
    "full": lambda n: fail(n, errno.ENOSPC, persistent=False),
    "broken": lambda n: fail(n, errno.EIO, persistent=True),
}


def watch_calls(fate: Fate) -> list[str]:
    """Let every call to the disk meet its fate first; returns the list that names them."""
    seen: list[str] = []

    def watched(name: str, original: Callable[..., object]) -> Callable[..., object]:
        def call(*arguments: object, **options: object) -> object:
            seen.append(name)
            fate(len(seen), name)
            return original(*arguments, **options)

        return call

    for name in CALLS:
        setattr(os, name, watched(name, getattr(os, name)))
    return seen


def skip_syncs() -> None:
    """Sync nothing: a killed process loses nothing that it wrote, and the test is quicker."""
    setattr(os, "fsync", lambda descriptor: None)  # noqa: B010  (as in `watch_calls`)


def canon(root: Path) -> str:
    """Digest all that the store answers, without stamps and times."""
    store = LocalArtifactStore(root)
    tables = {
        path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in store.layout.tables.rglob("*.parquet")
        if row_count(path)
    }
    recipes = {
        path.relative_to(root).as_posix(): str(read_answer(path).ref)
        for path in store.layout.recipes.glob("*/*.json")
    }
    objects = sorted(
        path.relative_to(root).as_posix()
        for path in store.layout.objects.rglob("*")
        if path.is_file()
    )
    champion = PolicyRegistry(store.layout).champion()
    manifest = read_manifest(store.layout, DAY)
    return json.dumps(
        [tables, recipes, objects, str(champion and champion.policy), str(manifest)], sort_keys=True
    )


def check_readable(root: Path) -> None:
    """Check that pandas reads whole tables: of each log its old rows, or its new ones."""
    for table in TABLES:
        rows = pd.read_parquet(root / "tables" / table)
        logs = sorted(rows["log_id"])
        allowed = [
            [f"{tag}-{k}" for tag in tags for k in range(3)] for tags in ("", "a", "b", "ab", "bc")
        ]
        if logs not in allowed:
            raise AssertionError(f"{table} shows {logs}")


def in_child(action: Callable[[], None]) -> tuple[int, str]:
    """Run in a process of its own; gives how it ended and the error it raised."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        code = 0
        try:
            skip_syncs()
            action()
        except ArtifactError as error:
            os.write(writing, str(error).encode())
            code = 3
        except BaseException:  # noqa: BLE001  (whatever ended the run is what is reported)
            os.write(writing, traceback.format_exc().encode()[-4000:])
            code = 4
        os._exit(code)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        text = pipe.read().decode()
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status), text


def runs(fate: str, work: str, folder: Path, stride: int) -> Iterator[dict[str, object]]:
    workload = WORKLOADS[work]
    base, reference, counted = folder / "base", folder / "reference", folder / "counted"
    expect(in_child(lambda: prepare(base)))
    for copy in (reference, counted):
        clone(base, copy)
    expect(in_child(lambda: workload(reference)))

    def remember() -> None:
        (folder / "canon").write_text(canon(reference))

    def count() -> None:
        seen = watch_calls(lambda number, name: None)
        workload(counted)
        (folder / "calls").write_text(json.dumps(seen))

    expect(in_child(remember))
    expect(in_child(count))
    calls = json.loads((folder / "calls").read_text())
    for n, name in list(enumerate(calls, start=1))[::stride]:
        root = folder / f"run-{n}"
        clone(base, root)

        def disturbed(root: Path = root, n: int = n) -> None:
            watch_calls(FATES[fate](n))
            workload(root)

        def rerun(root: Path = root) -> None:
            check_readable(root)
            workload(root)
            check_readable(root)
            found = canon(root)
            if found != (folder / "canon").read_text():
                raise AssertionError(f"canon differs: {found}")
            left = verify(LocalArtifactStore(root).layout)
            if left.damage is not Damage.NONE:
                raise AssertionError(str(left))

        code, text = in_child(disturbed)
        after, problem = in_child(rerun)
        shutil.rmtree(root)
        yield {"n": n, "call": name, "code": code, "error": text, "after": after, "why": problem}


def clone(source: Path, target: Path) -> None:
    """Copy a store, keeping which files are one."""
    target.mkdir()
    subprocess.run(["cp", "-a", f"{source}/.", str(target)], check=True)


def expect(ended: tuple[int, str]) -> None:
    if ended[0] != 0:
        raise AssertionError(ended[1])


if __name__ == "__main__":
    for run in runs(sys.argv[1], sys.argv[2], Path(sys.argv[3]), int(sys.argv[4])):
        sys.stdout.write(json.dumps(run) + "\n")
