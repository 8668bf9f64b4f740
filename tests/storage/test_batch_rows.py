"""Rows by batch: older days in one file each, the same rows whichever way they are read."""

from datetime import date, timedelta
from pathlib import Path

import numpy as np
import pandas as pd

from storage.artifact_store import LocalArtifactStore
from storage.batch_rows import TABLES, read_batch_rows
from storage.table_log import TableLog
from tests.storage.sample_tables import commit_sample

OLD = date(2026, 11, 20)
NEW = OLD + timedelta(days=1)
OF_A_LOG = (*TABLES, "trajectories")


def batches(store: LocalArtifactStore) -> set[str]:
    return {folder.name for folder in (store.layout.objects / "batch").glob("*")}


def store_of_two_days(root: Path) -> LocalArtifactStore:
    store = LocalArtifactStore(root)
    log = TableLog(store.layout)
    for tag, day in (("a", OLD), ("b", OLD), ("c", NEW)):
        commit_sample(store, log, tag, day=day, tables=OF_A_LOG)
    return store


def test_rows_are_the_same_whether_a_day_is_old_or_under_way(tmp_path: Path) -> None:
    store = store_of_two_days(tmp_path)
    log_by_log = read_batch_rows(store, TableLog(store.layout), newest=OLD)
    assert batches(store) == set()
    by_day = read_batch_rows(store, TableLog(store.layout), newest=NEW)
    assert len(batches(store)) == 1
    for table in TABLES:
        ours, theirs = getattr(by_day, table), getattr(log_by_log, table)
        assert len(ours) == 9
        pd.testing.assert_frame_equal(ours, theirs)
    chosen = ["c-1", "a-2", "a-2"]
    ours, theirs = by_day.whole_environments(chosen), log_by_log.whole_environments(chosen)
    pd.testing.assert_frame_equal(ours, theirs)


def test_cells_are_read_of_chosen_places_alone(tmp_path: Path) -> None:
    store = store_of_two_days(tmp_path)
    rows = read_batch_rows(store, TableLog(store.layout), newest=NEW)
    assert not {"cells", "observed"} & set(rows.environments.columns)
    chosen = rows.whole_environments(["c-1", "a-2"])
    assert chosen["environment_id"].tolist() == ["a-2", "c-1"]
    everything = pd.read_parquet(store.layout.table_folder("environments"))
    expected = everything[everything["environment_id"].isin(["a-2", "c-1"])]
    pd.testing.assert_frame_equal(chosen, expected.reset_index(drop=True))
    assert np.asarray(chosen["cells"][1]).nonzero()[0].tolist() == [29]
    assert list(rows.whole_environments([]).columns) == list(everything.columns)


def test_an_old_day_is_put_together_once_and_anew_when_it_changed(tmp_path: Path) -> None:
    store = store_of_two_days(tmp_path)
    read_batch_rows(store, TableLog(store.layout), newest=NEW)
    first = batches(store)
    read_batch_rows(store, TableLog(store.layout), newest=NEW)
    assert batches(store) == first
    commit_sample(store, TableLog(store.layout), "d", day=OLD, tables=OF_A_LOG)
    assert len(read_batch_rows(store, TableLog(store.layout), newest=NEW).scenarios) == 12
    assert len(batches(store)) == 2
