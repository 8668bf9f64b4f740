import multiprocessing
from concurrent.futures import ThreadPoolExecutor
from datetime import date
from pathlib import Path

import pandas as pd
import pytest

from ses_core.errors import ArtifactError
from ses_core.recipes import ArtifactRef, Recipe
from storage.artifact_store import LocalArtifactStore
from storage.stages import TRAIN
from storage.table_log import TableLog
from storage.table_parts import TablePart, artifact_parts
from storage.table_schemas import TABLES
from tests.storage.sample_tables import DAY, commit_sample

COMMITS = 20
WRITERS = 4


@pytest.fixture
def store(tmp_path: Path) -> LocalArtifactStore:
    return LocalArtifactStore(tmp_path)


def log_ids(store: LocalArtifactStore, table: str = "logs") -> list[str]:
    return sorted(pd.read_parquet(store.layout.table_folder(table))["log_id"])


def test_every_table_of_an_empty_store_opens(store: LocalArtifactStore) -> None:
    TableLog(store.layout)
    for table in TABLES:
        assert len(pd.read_parquet(store.layout.table_folder(table))) == 0


def test_committed_parts_are_the_artifacts_own_files(store: LocalArtifactStore) -> None:
    ref = commit_sample(store, TableLog(store.layout), "a")
    for table in TABLES:
        assert len(pd.read_parquet(store.layout.table_folder(table))) == 3
    shown = store.layout.table_folder("trajectories") / DAY.isoformat() / "a.parquet"
    assert shown.samefile(store.layout.object_folder(ref) / "trajectories.parquet")


def test_an_artifact_is_invisible_until_it_is_committed(store: LocalArtifactStore) -> None:
    log = TableLog(store.layout)
    ref = commit_sample(store, log, "a")
    parts = artifact_parts(store, ref, name="again", batch_date=DAY)
    assert log_ids(store) == ["a-0", "a-1", "a-2"]
    log.commit(parts, message="twice")
    assert len(log_ids(store)) == 6


def test_committing_again_writes_no_entry(store: LocalArtifactStore) -> None:
    log = TableLog(store.layout)
    commit_sample(store, log, "a")
    before = sorted(store.layout.table_log.glob("*.json"))
    commit_sample(store, TableLog(store.layout), "a")
    assert sorted(store.layout.table_log.glob("*.json")) == before


def test_a_part_of_the_same_name_replaces_the_old_one(store: LocalArtifactStore) -> None:
    log = TableLog(store.layout)
    commit_sample(store, log, "a", tables=("logs",))
    newer = commit_sample(store, log, "b", tables=("logs",))
    log.commit(artifact_parts(store, newer, name="a", batch_date=DAY), message="a is b")
    assert log_ids(store) == ["b-0", "b-0", "b-1", "b-1", "b-2", "b-2"]


def test_a_removed_part_is_readable_and_empty(store: LocalArtifactStore) -> None:
    log = TableLog(store.layout)
    commit_sample(store, log, "a")
    commit_sample(store, log, "b")
    log.commit([], [part for part in log.parts("scans") if part.name == "a"], message="drop")
    assert log_ids(store, "scans") == ["b-0", "b-1", "b-2"]
    assert log_ids(store, "logs") == ["a-0", "a-1", "a-2", "b-0", "b-1", "b-2"]
    assert [part.name for part in TableLog(store.layout).parts("scans")] == ["b"]


def test_a_writer_that_died_before_publishing_is_caught_up_with(store: LocalArtifactStore) -> None:
    log = TableLog(store.layout)
    commit_sample(store, log, "a")
    hint = (store.layout.tables / ".published.json").read_bytes()
    commit_sample(store, log, "b", tables=("logs",))
    (store.layout.table_folder("logs") / "b.parquet").unlink()
    (store.layout.tables / ".published.json").write_bytes(hint)
    assert log_ids(store) == ["a-0", "a-1", "a-2"]
    TableLog(store.layout)
    assert len(log_ids(store)) == 6


def test_a_deleted_view_is_made_again_at_open(store: LocalArtifactStore) -> None:
    commit_sample(store, TableLog(store.layout), "a")
    for path in sorted(store.layout.tables.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    TableLog(store.layout)
    assert len(log_ids(store, "trajectories")) == 3


def test_checkpoints_change_nothing_but_the_time_to_open(store: LocalArtifactStore) -> None:
    log = TableLog(store.layout)
    for number in range(120):
        commit_sample(store, log, f"log{number}", tables=("selections",))
    expected = TableLog(store.layout).all_parts()
    assert len(expected) == 120
    checkpoints = sorted((store.layout.table_log / "checkpoints").iterdir())
    assert [path.name for path in checkpoints] == ["00000050.json", "00000100.json"]
    checkpoints[1].write_bytes(checkpoints[1].read_bytes().replace(b"log7", b"log8", 1))
    assert TableLog(store.layout).all_parts() == expected
    for path in checkpoints:
        path.unlink()
    assert TableLog(store.layout).all_parts() == expected


def test_a_part_whose_artifact_is_gone_is_not_committed(store: LocalArtifactStore) -> None:
    part = TablePart(
        table="logs",
        name="a",
        ref=ArtifactRef("ingest", "0" * 64),
        file="logs.parquet",
        rows=3,
        size=10,
        sha256="0" * 64,
    )
    with pytest.raises(ArtifactError, match="missing"):
        TableLog(store.layout).commit([part], message="nothing")
    assert log_ids(store) == []


@pytest.mark.parametrize("name", ["_hidden", ".hidden", "a/b", "", "a b"])
def test_names_that_pandas_would_pass_over_are_refused(name: str) -> None:
    with pytest.raises(ValueError, match="part is called"):
        TablePart(
            table="logs",
            name=name,
            ref=ArtifactRef("ingest", "0" * 64),
            file="logs.parquet",
            rows=3,
            size=10,
            sha256="0" * 64,
        )


def test_an_artifact_without_tables_has_no_parts(store: LocalArtifactStore) -> None:
    def build(folder: Path) -> None:
        (folder / "policy.json").write_text("{}")

    ref = store.put(Recipe(TRAIN), build)
    with pytest.raises(ArtifactError, match="no file named after a table"):
        artifact_parts(store, ref, name="a", batch_date=date(2026, 1, 1))


def test_a_log_that_stays_open_sees_what_others_commit(store: LocalArtifactStore) -> None:
    log = TableLog(store.layout)
    commit_sample(store, log, "a", tables=("logs",))
    commit_sample(store, TableLog(store.layout), "b", tables=("logs",))
    assert [part.name for part in log.parts("logs")] == ["a", "b"]
    commit_sample(store, log, "c", tables=("logs",))
    assert len(log_ids(store)) == 9


def test_threads_that_share_a_log_lose_no_commit(store: LocalArtifactStore) -> None:
    log = TableLog(store.layout)

    def write(writer: int) -> None:
        for number in range(COMMITS):
            commit_sample(store, log, f"w{writer}n{number}", tables=("selections",))
            assert log.parts("selections")

    with ThreadPoolExecutor(WRITERS) as threads:
        list(threads.map(write, range(WRITERS)))
    names = {f"w{w}n{n}" for w in range(WRITERS) for n in range(COMMITS)}
    assert {part.name for part in TableLog(store.layout).parts("selections")} == names
    assert len(list(store.layout.table_log.glob("*.json"))) == WRITERS * COMMITS
    assert len(pd.read_parquet(store.layout.table_folder("selections"))) == 3 * len(names)


def _commit_many(root: Path, writer: int) -> None:
    store = LocalArtifactStore(root)
    log = TableLog(store.layout)
    for number in range(COMMITS):
        commit_sample(store, log, f"w{writer}n{number}", tables=("selections",))


def test_four_writers_lose_no_commit(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    writers = [
        context.Process(target=_commit_many, args=(tmp_path, writer)) for writer in range(WRITERS)
    ]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join(timeout=240)
    assert [writer.exitcode for writer in writers] == [0] * WRITERS
    store = LocalArtifactStore(tmp_path)
    names = {part.name for part in TableLog(store.layout).parts("selections")}
    assert names == {f"w{w}n{n}" for w in range(WRITERS) for n in range(COMMITS)}
    assert len(list(store.layout.table_log.glob("*.json"))) == WRITERS * COMMITS
    assert len(pd.read_parquet(store.layout.table_folder("selections"))) == 3 * len(names)
