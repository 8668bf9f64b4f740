"""The inbox from the outside: what is new, known, arriving or none of ours; and claiming it."""

import hashlib
import os
import sqlite3
from contextlib import closing
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from ses_core.errors import ArtifactError, LogError
from ses_core.robot_profile import GENERIC
from ses_core.settings import DecoderLimits, IngestSettings
from storage.inbox import Candidate, InboxScan, scan_inbox
from storage.inbox_ledger import InboxLedger, LedgerEntry
from storage.log_formats import ROSBAG1, ROSBAG2_MCAP, ROSBAG2_SQLITE
from storage.quarantine import REASONS, Quarantine, printable
from storage.rosbag_logs import RosbagLogReader
from storage.spool import RefusedClaimError, claim
from tests.log_factory import write_log

NOW = 1_800_000_000.0
SETTINGS = IngestSettings()


class Clock:
    """Time that passes only by waiting; each wait may do something to the inbox."""

    def __init__(self) -> None:
        self.now = NOW
        self.slept = 0.0
        self.on_sleep: list[Path] = []

    def time(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds
        self.slept += seconds
        for path in self.on_sleep:
            with path.open("ab") as file:
                file.write(b"more")


@pytest.fixture
def inbox(tmp_path: Path) -> Path:
    folder = tmp_path / "inbox"
    folder.mkdir()
    return folder


def scan(inbox: Path, clock: Clock | None = None) -> InboxScan:
    clock = clock or Clock()
    return scan_inbox(
        inbox,
        ledger=InboxLedger(inbox.parent / "ledger"),
        settings=SETTINGS,
        progress=lambda line: None,
        clock=clock.time,
        sleep=clock.sleep,
    )


def put(path: Path, content: bytes = b"#ROSBAG V2.0\nrest", age: float = 3600.0) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    os.utime(path, (NOW - age, NOW - age))
    return path


def only(inbox: Path) -> Candidate:
    (candidate,) = scan(inbox).new
    return candidate


def test_files_that_are_no_logs_are_passed_over_and_counted(inbox: Path) -> None:
    put(inbox / "berlin" / "r1" / "a.bag")
    for name in ("README.md", "b.bag.part", "c.tmp", "d.filepart", "e.bag.active", "a.bag.done"):
        put(inbox / "berlin" / "r1" / name)
    put(inbox / "berlin" / "r1" / ".hidden.bag")
    found = scan(inbox)
    assert [item.relative for item in found.new] == ["berlin/r1/a.bag"]
    assert found.new[0].identity.robot == "r1"
    assert found.ignored_count == 6
    assert found.unidentified_count == 0


def test_a_folder_with_metadata_is_one_upload(inbox: Path) -> None:
    write_log(inbox, "mcap")
    for path in (inbox / "mcap").iterdir():
        os.utime(path, (NOW - 3600, NOW - 3600))
    candidate = only(inbox)
    assert (candidate.relative, len(candidate.files)) == ("mcap", 2)
    assert scan(inbox).unidentified_count == 1


def test_a_known_upload_is_recognised_without_reading_it(inbox: Path) -> None:
    path = put(inbox / "a.bag")
    ledger = InboxLedger(inbox.parent / "ledger")
    entry = LedgerEntry("f" * 64, "quarantined", "truncated")
    ledger.record(only(inbox).fingerprint, entry)
    path.chmod(0)
    found = scan(inbox)
    assert (found.new, found.known[0].entry) == ((), entry)
    path.chmod(0o600)
    put(path, b"#ROSBAG V2.0\nanother content")
    assert len(scan(inbox).new) == 1


def test_an_old_upload_is_taken_at_once_and_a_young_one_is_waited_for(inbox: Path) -> None:
    put(inbox / "old.bag", age=61.0)
    clock = Clock()
    assert len(scan(inbox, clock).new) == 1
    assert clock.slept == 0.0
    put(inbox / "young.bag", age=10.0)
    found = scan(inbox, clock)
    assert len(found.new) == 2
    assert clock.slept == pytest.approx(50.0)


def test_an_upload_that_still_grows_is_left_for_the_next_night(inbox: Path) -> None:
    put(inbox / "steady.bag", age=5.0)
    clock = Clock()
    clock.on_sleep = [put(inbox / "growing.bag", age=1.0)]
    found = scan(inbox, clock)
    assert [item.name for item in found.new] == ["steady.bag"]
    assert [item.name for item in found.waiting] == ["growing.bag"]
    assert clock.slept <= SETTINGS.steady_s


def test_a_sidecar_says_that_a_young_upload_is_complete(inbox: Path) -> None:
    content = b"#ROSBAG V2.0\nrest"
    put(inbox / "a.bag", content, age=0.0)
    put(inbox / "a.bag.done", b"")
    put(inbox / "b.bag", content, age=0.0)
    put(inbox / "b.bag.sha256", hashlib.sha256(content).hexdigest().encode() + b"  b.bag\n")
    clock = Clock()
    assert len(scan(inbox, clock).new) == 2
    assert clock.slept == 0.0


def test_a_stamp_from_the_future_is_not_waited_for_longer_than_the_setting(inbox: Path) -> None:
    put(inbox / "a.bag", age=-1e6)
    clock = Clock()
    assert len(scan(inbox, clock).new) == 1
    assert clock.slept == pytest.approx(SETTINGS.steady_s)


def test_the_same_content_has_the_same_id_under_any_name(inbox: Path, tmp_path: Path) -> None:
    put(inbox / "x" / "a.bag")
    put(inbox / "y" / "strange ? name*.mcap")
    claims = [claim(item, staging=tmp_path / "spool") for item in scan(inbox).new]
    assert len({item.log_id for item in claims}) == 1
    # The first bytes decide, not the name; and our own name is on the copy.
    assert {item.format for item in claims} == {ROSBAG1}
    assert {item.payload.name for item in claims} == {f"{claims[0].log_id}.bag"}
    assert [path.name for path in (tmp_path / "spool").iterdir()] == [claims[0].payload.name]


@pytest.mark.parametrize("kind", ["db3", "db3-file", "mcap", "mcap-file", "mcap-message"])
def test_a_claimed_folder_can_be_decoded(kind: str, inbox: Path, tmp_path: Path) -> None:
    write_log(inbox, kind)
    for path in (inbox / kind).iterdir():
        os.utime(path, (NOW - 3600, NOW - 3600))
    claimed = claim(only(inbox), staging=tmp_path / "spool")
    assert claimed.format == (ROSBAG2_SQLITE if "db3" in kind else ROSBAG2_MCAP)
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    reader = RosbagLogReader(limits=DecoderLimits(), workdir=scratch)
    recording = reader.read(claimed.payload, profile=GENERIC, pose_source="odometry")
    assert len(recording.poses.poses) == 401
    assert recording.warnings == {}


def test_messages_left_in_a_write_ahead_log_are_not_lost(inbox: Path, tmp_path: Path) -> None:
    write_log(tmp_path, "db3")
    database = next((tmp_path / "db3").glob("*.db3"))
    with closing(sqlite3.connect(database)) as connection:
        connection.execute("PRAGMA journal_mode=WAL")
        connection.execute("PRAGMA wal_autocheckpoint=0")
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        topic = connection.execute("SELECT id FROM topics WHERE name = '/odom'").fetchone()[0]
        connection.execute(
            "INSERT INTO messages (topic_id, timestamp, data)"
            " SELECT topic_id, timestamp + 20000000000, data FROM messages WHERE topic_id = ?",
            (topic,),
        )
        connection.commit()
        # As a killed recorder leaves them: the log beside the database, not in it.
        for suffix in ("", "-wal"):
            source = database.with_name(database.name + suffix)
            put(inbox / f"night.db3{suffix}", source.read_bytes())
    claimed = claim(only(inbox), staging=tmp_path / "spool")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    reader = RosbagLogReader(limits=DecoderLimits(), workdir=scratch)
    recording = reader.read(claimed.payload, profile=GENERIC, pose_source="odometry")
    assert np.ptp(recording.poses.stamps_ns) == pytest.approx(40e9, rel=1e-3)
    assert "maybe_truncated" not in recording.warnings
    alone = put(inbox / "alone.db3", (inbox / "night.db3").read_bytes())
    (candidate,) = [item for item in scan(inbox).new if item.path == alone]
    claimed = claim(candidate, staging=tmp_path / "spool")
    recording = reader.read(claimed.payload, profile=GENERIC, pose_source="odometry")
    assert recording.warnings == {"maybe_truncated": 1}


def refused(inbox: Path, tmp_path: Path) -> RefusedClaimError:
    with pytest.raises(RefusedClaimError) as error:
        claim(only(inbox), staging=tmp_path / "spool")
    assert error.value.reason in REASONS
    return error.value


def test_a_link_to_a_folder_is_passed_over(inbox: Path, tmp_path: Path) -> None:
    put(tmp_path / "elsewhere" / "a.bag")
    (inbox / "r1").symlink_to(tmp_path / "elsewhere")
    put(inbox / ".hidden" / "b.bag")
    found = scan(inbox)
    assert (found.new, found.ignored_count) == ((), 1)


def test_an_inbox_that_is_not_there_is_named(inbox: Path) -> None:
    with pytest.raises(ArtifactError, match=r"inbox .*missing cannot be read"):
        scan(inbox / "missing")


def test_a_symbolic_link_is_refused_and_never_followed(inbox: Path, tmp_path: Path) -> None:
    secret = put(tmp_path / "secret.bag")
    (inbox / "a.bag").symlink_to(secret)
    os.utime(inbox / "a.bag", (NOW - 3600, NOW - 3600), follow_symlinks=False)
    error = refused(inbox, tmp_path)
    assert (error.reason, error.payload) == ("unsupported", None)
    assert list((tmp_path / "spool").iterdir()) == []


def test_a_pipe_is_refused_without_waiting_for_it(inbox: Path, tmp_path: Path) -> None:
    os.mkfifo(inbox / "a.bag")
    os.utime(inbox / "a.bag", (NOW - 3600, NOW - 3600))
    assert refused(inbox, tmp_path).reason == "unsupported"


def test_a_second_name_is_refused_unless_nobody_can_write(inbox: Path, tmp_path: Path) -> None:
    path = put(inbox / "a.bag")
    (tmp_path / "other").hardlink_to(path)
    assert refused(inbox, tmp_path).reason == "unsupported"
    path.chmod(0o444)
    assert claim(only(inbox), staging=tmp_path / "spool").format == ROSBAG1


@pytest.mark.parametrize(("content", "reason"), [(b"", "empty"), (b"\x00\xff" * 99, "bad_magic")])
def test_files_without_a_known_beginning_are_refused(
    content: bytes, reason: str, inbox: Path, tmp_path: Path
) -> None:
    put(inbox / "a.bag", content)
    error = refused(inbox, tmp_path)
    assert error.reason == reason
    assert error.payload is not None
    assert error.payload.read_bytes() == content


def test_a_checksum_that_disagrees_refuses_the_log(inbox: Path, tmp_path: Path) -> None:
    put(inbox / "a.bag")
    put(inbox / "a.bag.sha256", b"0" * 64)
    assert refused(inbox, tmp_path).reason == "checksum"


def test_refused_logs_are_kept_listed_found_and_released(inbox: Path, tmp_path: Path) -> None:
    put(inbox / "site" / "a\x1b[31m.bag", b"\x00\xff" * 99)
    candidate = only(inbox)
    error = refused(inbox, tmp_path)
    quarantine = Quarantine(tmp_path / "quarantine")
    kept = quarantine.put(
        error,
        log_id=error.log_id,
        batch_date=date(2026, 11, 22),
        relative=candidate.relative,
        site=candidate.identity.site,
        robot=candidate.identity.robot,
        format="",
        decoder_version=1,
        payload=error.payload,
    )
    assert kept.payload is not None
    assert kept.payload.read_bytes() == b"\x00\xff" * 99
    assert "\x1b" not in kept.relative
    assert quarantine.entries() == [kept]
    assert quarantine.find(error.log_id[:8]) == kept
    assert quarantine.worth_retrying(decoder_version=1) == []
    assert quarantine.worth_retrying(decoder_version=2) == [kept]
    quarantine.release(error.log_id)
    assert quarantine.entries() == []
    with pytest.raises(ArtifactError, match="expected one"):
        quarantine.find("abc")


def test_an_unknown_reason_is_a_bug_of_ours_and_names_are_printable(tmp_path: Path) -> None:
    kept = Quarantine(tmp_path).put(
        LogError("whim", "no\x00thing\n" * 100),
        log_id="b" * 64,
        batch_date=date(2026, 1, 1),
        relative="/../../etc/passwd\x00\n",
        site="s",
        robot="r",
        format="",
        decoder_version=1,
        payload=None,
    )
    assert kept.reason == "decoder_bug"
    assert len(kept.message) <= 500
    assert printable("a\nb\x00") == "a\ufffdb\ufffd"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["2026-01-01"]
