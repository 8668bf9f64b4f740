import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import pandas as pd
import pytest

from ses_core.errors import ArtifactError
from ses_core.recipes import Recipe, Stage
from ses_core.settings import StoreSettings
from storage.artifact_store import LocalArtifactStore
from storage.durable_files import temporary_name
from storage.file_lock import file_lock
from storage.garbage_collection import Collected, collect_garbage
from storage.materialize import materialize
from storage.policy_registry import PolicyRegistry
from storage.stages import EXTRACT, FIT, INGEST, TRAIN
from storage.table_log import TableLog
from storage.table_reader import open_table
from storage.verification import verify
from tests.storage.sample_tables import commit_sample

KEEP = StoreSettings(scan_retention_days=90, artifact_retention_days=90)


@pytest.fixture
def store(tmp_path: Path) -> LocalArtifactStore:
    return LocalArtifactStore(tmp_path)


def collect(store: LocalArtifactStore, *, in_days: float = 0.0) -> Collected:
    return collect_garbage(store.layout, now=datetime.now(UTC) + timedelta(days=in_days), keep=KEEP)


def text(content: str) -> Callable[[Path], None]:
    def build(folder: Path) -> None:
        (folder / "text").write_text(content)

    return build


def test_a_fresh_store_keeps_everything(store: LocalArtifactStore) -> None:
    commit_sample(store, TableLog(store.layout), "a", day=datetime.now(UTC).date())
    collected = collect(store)
    assert collected == Collected(temporaries=0, recipes=0, objects=0, scan_parts=0, freed_bytes=0)


def test_what_a_dead_process_left_goes_and_what_a_living_one_builds_stays(
    store: LocalArtifactStore,
) -> None:
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    mine = temporary_name(store.layout.staging / "ingest")
    mine.mkdir()
    name = mine.name.replace(f".{os.getpid()}.", f".{dead.pid}.")
    (store.layout.staging / name).mkdir()
    (store.layout.staging / name / "rows").write_bytes(b"12345")
    (store.layout.table_log / name).write_bytes(b"123")
    collected = collect(store)
    assert (collected.temporaries, collected.freed_bytes) == (2, 8)
    assert list(store.layout.staging.iterdir()) == [mine]
    assert collect(store, in_days=2).temporaries == 1


def test_only_old_artifacts_that_nothing_leads_to_go(store: LocalArtifactStore) -> None:
    kept = store.put(Recipe(INGEST, {"n": 1}), text("kept"))
    lost = store.put(Recipe(INGEST, {"n": 2}), text("lost"))
    champion = store.put(Recipe(TRAIN), text("champion"))
    PolicyRegistry(store.layout).promote(champion, policy_id="p", run_id="r", reason="")
    store.forget(Recipe(INGEST, {"n": 2}))
    store.forget(Recipe(TRAIN))
    assert collect(store).objects == 0
    assert collect(store, in_days=2).objects == 1
    assert store.path(kept)
    assert store.path(champion)
    with pytest.raises(ArtifactError, match="missing"):
        store.path(lost)


def test_answers_long_not_asked_for_go_only_where_they_are_disposable_or_outdated(
    store: LocalArtifactStore,
) -> None:
    recipes = {
        "fit": Recipe(FIT),
        "extract": Recipe(EXTRACT),
        "outdated": Recipe(Stage(EXTRACT.name, EXTRACT.version - 1)),
    }
    for name, recipe in recipes.items():
        store.put(recipe, text(name))
    assert collect(store, in_days=89).recipes == 0
    collected = collect(store, in_days=91)
    assert (collected.recipes, collected.objects) == (2, 2)
    assert store.find(recipes["extract"]) is not None
    assert store.find(recipes["fit"]) is None
    assert not materialize(store, recipes["fit"], text("fit")).found


def test_asking_for_an_answer_keeps_it(store: LocalArtifactStore) -> None:
    store.put(Recipe(FIT), text("fit"))
    path = store.layout.recipe_file(FIT.name, Recipe(FIT).key())
    long_ago = time.time() - 100 * 86400
    os.utime(path, (long_ago, long_ago))
    assert store.find(Recipe(FIT)) is not None
    assert collect(store).recipes == 0


def test_scans_beyond_their_retention_go_and_nothing_else_does(store: LocalArtifactStore) -> None:
    log = TableLog(store.layout)
    old = commit_sample(store, log, "old", day=date(2026, 1, 1))
    commit_sample(store, log, "new", day=date(2026, 4, 1))
    now = datetime(2026, 4, 2, tzinfo=UTC)
    collected = collect_garbage(store.layout, now=now, keep=KEEP)
    assert collected.scan_parts == 1
    assert collected.freed_bytes > 1000
    for rows in (
        pd.read_parquet(store.layout.table_folder("scans")),
        open_table(store.layout.root, "scans"),
    ):
        assert set(rows["log_id"]) == {"new-0", "new-1", "new-2"}
    assert len(open_table(store.layout.root, "trajectories")) == 6
    assert not (store.path(old) / "scans.parquet").exists()
    assert store.find(Recipe(INGEST, {"tag": "old"})) == old
    with pytest.raises(ArtifactError, match="dropped"):
        store.file(old, "scans.parquet")
    assert verify(store.layout).findings == ()
    assert collect_garbage(store.layout, now=now, keep=KEEP).scan_parts == 0


def test_a_damaged_log_stops_the_collection_before_anything_goes(
    store: LocalArtifactStore,
) -> None:
    commit_sample(store, TableLog(store.layout), "a")
    store.forget(Recipe(INGEST, {"tag": "a"}))
    for path in store.layout.table_log.rglob("*.json"):
        path.write_bytes(b"?")
    with pytest.raises(ArtifactError, match="damaged"):
        collect(store, in_days=9)
    assert len(list(store.layout.objects.glob("*/*"))) == 1


def test_no_artifact_is_put_in_place_while_others_are_taken_away(
    store: LocalArtifactStore,
) -> None:
    thread = threading.Thread(target=store.put, args=(Recipe(INGEST), text("waits")))
    with file_lock(store.layout.sweep_lock):
        thread.start()
        thread.join(timeout=0.5)
        assert store.find(Recipe(INGEST)) is None
        assert list(store.layout.objects.glob("*/*")) == []
    thread.join()
    assert store.find(Recipe(INGEST)) is not None


def test_collecting_without_end_disturbs_neither_readers_nor_writers(
    store: LocalArtifactStore,
) -> None:
    """An old artifact loses its recipe and gets it back, while it may be collected."""
    recent = datetime.now(UTC).date()
    commit_sample(store, TableLog(store.layout), "first", day=recent, tables=("logs", "scans"))
    failures: list[str] = []
    ended = threading.Event()

    def lose_and_make_again() -> None:
        recipe = Recipe(EXTRACT, {"n": 0})
        ref = store.put(recipe, text("always the same"))
        long_ago = time.time() - 2 * 86400
        store.forget(recipe)
        with suppress(FileNotFoundError):
            os.utime(store.layout.object_folder(ref), (long_ago, long_ago))
        ref = store.put(recipe, text("always the same"))
        assert (store.path(ref) / "text").read_text() == "always the same"

    actions: list[Callable[[], object]] = [
        lambda: collect(store),
        lose_and_make_again,
        lambda: pd.read_parquet(store.layout.table_folder("scans")),
        lambda: open_table(store.layout.root, "logs"),
    ]

    def repeat(action: Callable[[], object]) -> None:
        while not ended.is_set():
            try:
                action()
            except Exception as error:  # noqa: BLE001  (any failure is the finding)
                failures.append(repr(error))

    threads = [threading.Thread(target=repeat, args=(action,)) for action in actions]
    for thread in threads:
        thread.start()
    try:
        log = TableLog(store.layout)
        for number in range(12):
            commit_sample(store, log, f"log{number}", day=recent, tables=("logs", "scans"))
    finally:
        ended.set()
        for thread in threads:
            thread.join()
    assert failures == []
    assert len(pd.read_parquet(store.layout.table_folder("logs"))) == 39
    assert verify(store.layout).findings == ()
