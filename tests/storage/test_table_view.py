import errno
import os
from pathlib import Path

import pandas as pd
import pytest

from storage.artifact_store import LocalArtifactStore
from storage.table_log import TableLog
from storage.verification import verify
from tests.storage.sample_tables import commit_sample

TABLES = ("logs", "scans")


@pytest.mark.parametrize("code", [errno.EXDEV, errno.EPERM, errno.EMLINK])
def test_where_files_cannot_be_linked_they_are_copied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    original = os.link

    def refuse(source: Path, target: Path) -> None:
        if Path(target).is_relative_to(tmp_path / "tables"):
            raise OSError(code, os.strerror(code))
        original(source, target)

    monkeypatch.setattr(os, "link", refuse)
    store = LocalArtifactStore(tmp_path)
    log = TableLog(store.layout)
    ref = commit_sample(store, log, "a", tables=TABLES)
    shown = tmp_path / "tables" / "logs" / "a.parquet"
    assert not shown.samefile(store.path(ref) / "logs.parquet")
    assert len(pd.read_parquet(shown.parent)) == 3
    assert verify(store.layout).findings == ()
    log.commit([], log.parts("scans"), message="drop")
    assert len(pd.read_parquet(tmp_path / "tables" / "scans")) == 0


def test_a_reader_that_listed_the_folder_finds_every_file_after_changes(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    log = TableLog(store.layout)
    commit_sample(store, log, "a", tables=TABLES)
    listed = list((tmp_path / "tables").rglob("*.parquet"))
    log.commit([], log.parts("scans"), message="drop")
    log.publish(anew=True)
    for path in listed:
        pd.read_parquet(path)
