from pathlib import Path

import pytest

from ses_core.errors import ArtifactError
from storage.numbered_log import NO_ENTRY, NumberedLog


def append(log: NumberedLog, *texts: str) -> list[str]:
    digests = [NO_ENTRY, *(entry.digest for entry in log.after(0, NO_ENTRY))]
    for text in texts:
        entry = log.append(len(digests), digests[-1], {"text": text})
        assert entry is not None
        digests.append(entry.digest)
    return digests


def texts(log: NumberedLog) -> list[object]:
    return [entry.value["text"] for entry in log.after(0, NO_ENTRY)]


def test_entries_come_back_in_order(tmp_path: Path) -> None:
    append(NumberedLog(tmp_path), "one", "two", "three")
    assert texts(NumberedLog(tmp_path)) == ["one", "two", "three"]


def test_a_taken_number_is_refused_and_kept(tmp_path: Path) -> None:
    log = NumberedLog(tmp_path)
    append(log, "one")
    assert log.append(1, NO_ENTRY, {"text": "late"}) is None
    assert texts(log) == ["one"]


@pytest.mark.parametrize("damage", [b"", b"{}", b'{"number": 2, "text": "forged"}', None])
def test_one_damaged_or_lost_file_loses_nothing(tmp_path: Path, damage: bytes | None) -> None:
    log = NumberedLog(tmp_path)
    append(log, "one", "two", "three")
    path = log.path(2)
    path.unlink() if damage is None else path.write_bytes(damage)
    assert texts(log) == ["one", "two", "three"]
    append(log, "four")
    entries = list(log.after(0, NO_ENTRY))
    assert log.damaged_files(entries[1]) == [path]
    log.restore(entries[1], path)
    assert [log.damaged_files(entry) for entry in entries] == [[], [], [], []]


def test_a_copy_that_was_never_made_is_made_by_the_next_writer(tmp_path: Path) -> None:
    log = NumberedLog(tmp_path)
    append(log, "one")
    log.copy_path(1).unlink()
    append(log, "two")
    assert log.copy_path(1).read_bytes() == log.path(1).read_bytes()


def test_an_entry_damaged_twice_is_named(tmp_path: Path) -> None:
    log = NumberedLog(tmp_path)
    append(log, "one", "two")
    for path in (log.path(1), log.copy_path(1)):
        path.write_bytes(path.read_bytes().replace(b"one", b"won"))
    with pytest.raises(ArtifactError, match=r"00000001\.json is damaged"):
        texts(log)


def test_an_entry_of_another_history_is_found_by_its_parent(tmp_path: Path) -> None:
    ours, theirs = NumberedLog(tmp_path / "ours"), NumberedLog(tmp_path / "theirs")
    append(ours, "one", "two")
    append(theirs, "uno", "due")
    for path in (ours.path(2), ours.copy_path(2)):
        path.write_bytes(theirs.path(2).read_bytes())
    with pytest.raises(ArtifactError, match="follows an entry with digest"):
        texts(ours)
