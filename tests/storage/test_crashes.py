"""What is left when a writer is killed, or the disk fills up, in the middle of anything."""

import json
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ses_core.errors import ArtifactError
from storage.artifact_store import LocalArtifactStore
from storage.table_log import TableLog
from storage.verification import Damage, verify
from tests.storage.crash_loop import TABLES
from tests.storage.sample_tables import commit_sample

ROOT = Path(__file__).parents[2]
KILLED = -signal.SIGKILL
REFUSED = 3
KILLS = 4


def disturbed_runs(fate: str, work: str, folder: Path, stride: int) -> list[dict[str, object]]:
    module = "tests.storage.crash_writer"
    command = [sys.executable, "-m", module, fate, work, str(folder), str(stride)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    return [json.loads(line) for line in ended.stdout.splitlines()]


def check_kills(work: str, folder: Path, stride: int, least: int) -> None:
    runs = disturbed_runs("kill", work, folder, stride)
    assert len(runs) >= least
    assert [run for run in runs if run["code"] != KILLED] == []
    assert [run for run in runs if run["after"] != 0] == []


def check_faults(fate: str, work: str, folder: Path, stride: int, least: int) -> None:
    runs = disturbed_runs(fate, work, folder, stride)
    assert len(runs) >= least
    assert [run for run in runs if run["code"] != REFUSED] == []
    assert [run for run in runs if "bytes free" not in str(run["error"])] == []
    assert [run for run in runs if run["after"] != 0] == []


def test_a_night_killed_before_every_third_call_is_repeated_alike(tmp_path: Path) -> None:
    check_kills("night", tmp_path, stride=3, least=30)


def test_a_collection_killed_before_any_call_is_repeated_alike(tmp_path: Path) -> None:
    check_kills("collection", tmp_path, stride=1, least=15)


@pytest.mark.parametrize(("fate", "work"), [("full", "night"), ("broken", "night")])
def test_a_failing_call_is_named_and_leaves_the_old_state(
    tmp_path: Path, fate: str, work: str
) -> None:
    check_faults(fate, work, tmp_path, stride=8, least=12)


@pytest.mark.slow
def test_a_night_killed_before_every_single_call_is_repeated_alike(tmp_path: Path) -> None:
    check_kills("night", tmp_path, stride=1, least=80)


@pytest.mark.slow
@pytest.mark.parametrize("fate", ["full", "broken"])
@pytest.mark.parametrize(("work", "least"), [("night", 80), ("collection", 15)])
def test_every_single_failing_call_is_named_and_leaves_the_old_state(
    tmp_path: Path, fate: str, work: str, least: int
) -> None:
    check_faults(fate, work, tmp_path, stride=1, least=least)


def test_tables_are_readable_while_their_writer_is_killed_again_and_again(tmp_path: Path) -> None:
    """A reader opens the tables all the time; the writer dies at random instants."""
    store = LocalArtifactStore(tmp_path)
    commit_sample(store, TableLog(store.layout), "first", tables=TABLES)
    failures: list[str] = []
    reads = 0
    ended = threading.Event()

    def read() -> None:
        nonlocal reads
        while not ended.is_set():
            for table in TABLES:
                try:
                    rows = pd.read_parquet(tmp_path / "tables" / table)
                except Exception as error:  # noqa: BLE001  (any failure to read is the finding)
                    failures.append(repr(error))
                    continue
                counts = rows["log_id"].str.rsplit("-", n=1).str[0].value_counts()
                if set(counts) != {3}:
                    failures.append(f"{table}: {counts.to_dict()}")
                reads += 1

    reader = threading.Thread(target=read)
    reader.start()
    rng = np.random.default_rng(7)
    try:
        for _ in range(KILLS):
            _kill_after_first_commits(tmp_path, delay=float(rng.uniform(0.0, 0.15)))
    finally:
        ended.set()
        reader.join()
    assert failures == []
    assert reads > 10
    shown = pd.read_parquet(tmp_path / "tables" / "logs")["log_id"]
    tags = {tag.rsplit("-", 1)[0] for tag in shown}
    assert len(shown) == 3 * len(tags)
    assert len(tags) > KILLS
    assert verify(LocalArtifactStore(tmp_path).layout).damage is Damage.NONE


def _kill_after_first_commits(root: Path, *, delay: float) -> None:
    command = [sys.executable, "-m", "tests.storage.crash_loop", str(root)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE) as writer:
        assert writer.stdout is not None
        writer.stdout.readline()
        time.sleep(delay)
        writer.kill()


@pytest.mark.parametrize("size", [0, 1, 60, 700, 3000, 4000])
def test_a_file_that_cannot_grow_is_named_and_leaves_the_old_state(
    tmp_path: Path, size: int
) -> None:
    store = LocalArtifactStore(tmp_path)
    log = TableLog(store.layout)
    commit_sample(store, log, "a", tables=TABLES)
    before = _visible(tmp_path)

    def take_in() -> None:
        commit_sample(store, log, "b", tables=TABLES)

    with pytest.raises(ArtifactError, match=r"bytes free"):
        _with_largest_file(size, take_in)
    assert _visible(tmp_path) == before
    assert list(store.layout.staging.iterdir()) == []
    take_in()
    assert len(pd.read_parquet(tmp_path / "tables" / "scans")) == 6


def _with_largest_file(size: int, action: Callable[[], None]) -> None:
    """Let no file grow beyond a size [B]: every kind of writer then fails in the middle."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        action()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, ignored)


def _visible(root: Path) -> dict[str, int]:
    return {table: len(pd.read_parquet(root / "tables" / table)) for table in TABLES}
