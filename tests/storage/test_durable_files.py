import errno
import os
from pathlib import Path

import pytest

from ses_core.errors import ArtifactError
from storage.durable_files import (
    MACHINE_FAULTS,
    disk_errors,
    make_folder,
    replace_file,
    temporary_name,
    temporary_owner,
    write_if_absent,
)


def test_the_first_content_wins_and_the_second_is_told(tmp_path: Path) -> None:
    path = tmp_path / "below" / "entry"
    assert write_if_absent(path, b"first")
    assert write_if_absent(path, b"first")
    assert not write_if_absent(path, b"second")
    assert path.read_bytes() == b"first"
    assert list(path.parent.iterdir()) == [path]


def test_replacing_leaves_nothing_but_the_new_content(tmp_path: Path) -> None:
    path = tmp_path / "manifest"
    replace_file(path, b"old")
    replace_file(path, b"new")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("write", [write_if_absent, replace_file])
def test_a_failing_sync_leaves_neither_file_nor_temporary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, write: object
) -> None:
    def fail(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    assert callable(write)
    with pytest.raises(ArtifactError, match=r"entry: no space left on device \(\d+ bytes free\)"):
        write(tmp_path / "entry", b"content")
    assert list(tmp_path.iterdir()) == []


def test_only_the_machines_faults_are_turned_where_only_they_are_meant(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), disk_errors(tmp_path, only=MACHINE_FAULTS):
        (tmp_path / "absent").read_bytes()
    with pytest.raises(ArtifactError, match="absent: no such file"), disk_errors(tmp_path):
        (tmp_path / "absent").read_bytes()


def test_a_temporary_tells_its_owner_and_nothing_else_has_one(tmp_path: Path) -> None:
    temporary = temporary_name(tmp_path / "rows.parquet")
    assert temporary.parent == tmp_path
    assert temporary.name.startswith(".")
    assert temporary_owner(temporary) == os.getpid()
    for name in ("rows.parquet", ".published.json", ".a.b.c.part", "x.1.2.part"):
        assert temporary_owner(tmp_path / name) is None


def test_folders_are_made_all_the_way_down(tmp_path: Path) -> None:
    make_folder(tmp_path / "a" / "b" / "c")
    make_folder(tmp_path / "a" / "b" / "c")
    assert (tmp_path / "a" / "b" / "c").is_dir()
