"""What a night costs per new log when the store is full, against the same log on an empty store.

Only the stages before synthesis: everything after them depends on the night's own logs anyway.
"""

import datetime as dt
import statistics
import time
from pathlib import Path

import numpy as np
from prefect.settings import PREFECT_FLOWS_HEARTBEAT_FREQUENCY, temporary_settings

from flows.nightly_batch import extract_only, ingest_only
from ses_core.extraction.recording import CommandStream, PoseStream, ScanStream
from ses_core.geometry import Pose2D
from ses_core.settings import IngestSettings, Settings
from storage.bag_messages import BagContent
from storage.rosbag_writer import write_rosbag

OLD_LOGS = 200
REPETITIONS = 5
TODAY = dt.date(2026, 1, 2)
SETTINGS = Settings(ingest=IngestSettings(steady_s=0.0))


def measure(scratch: Path) -> list[dict[str, str | float]]:
    """Take one log into a store of 200 and into an empty one, five times each, by turns.

    The old logs are of an earlier day, as they are in a store that is used every night. The
    first new log after them also puts their rows together, which later ones find done: it has
    a row of its own.

    Prefect's heartbeat is off here: it sleeps in whole seconds, and a flow that ends waits for it,
    which would round what both sides take up to seconds.
    """
    with temporary_settings({PREFECT_FLOWS_HEARTBEAT_FREQUENCY: None}):
        return _measure(scratch)


def _measure(scratch: Path) -> list[dict[str, str | float]]:
    full, inbox = scratch / "full", scratch / "inbox"
    for number in range(OLD_LOGS):
        write_drive(inbox, f"old-{number:03d}", seed=number)
    take_in(full, inbox, day=TODAY - dt.timedelta(days=1))
    ours, theirs = [], []
    for number in range(REPETITIONS):
        seed = OLD_LOGS + number
        write_drive(inbox, f"new-{number}", seed=seed)
        ours.append(take_in(full, inbox))
        alone = scratch / f"inbox-{number}"
        write_drive(alone, f"new-{number}", seed=seed)
        theirs.append(take_in(scratch / f"empty-{number}", alone))
    return [
        _row(
            f"first new log after {OLD_LOGS} old ones, against an empty store", ours[0], theirs[0]
        ),
        _row(
            f"one new log beside {OLD_LOGS} old ones, against an empty store",
            statistics.median(ours[1:]),
            statistics.median(theirs[1:]),
        ),
    ]


def _row(name: str, ours: float, theirs: float) -> dict[str, str | float]:
    return {
        "name": name,
        "unit": "s",
        "ours": round(ours, 3),
        "theirs": round(theirs, 3),
        "ratio": round(ours / theirs, 3),
    }


def take_in(root: Path, inbox: Path, *, day: dt.date = TODAY) -> float:
    """Run the stages before synthesis; give the seconds they took."""
    started = time.perf_counter()
    ingest_only(inbox=inbox, root=root, date=day, settings=SETTINGS)
    extract_only(root=root, settings=SETTINGS)
    return time.perf_counter() - started


def write_drive(inbox: Path, name: str, *, seed: int) -> None:
    """Write two minutes of a robot that winds through a corridor, backing off now and then."""
    rng = np.random.default_rng(seed)
    stamps = 1_700_000_000_000_000_000 + 50_000_000 * np.arange(2400, dtype=np.int64)
    speed = np.where(rng.random(2400 // 40).repeat(40) < 0.2, -0.2, 0.5)
    turning = rng.normal(0.0, 0.3, 2400 // 20).repeat(20)
    yaw = np.cumsum(turning * 0.05)
    steps = speed * 0.05
    poses = np.column_stack((np.cumsum(steps * np.cos(yaw)), np.cumsum(steps * np.sin(yaw)), yaw))
    twists = np.column_stack((speed, turning))
    angles = np.linspace(-2.3, 2.3, 360)
    ranges = rng.uniform(1.0, 6.0, (len(stamps[::4]), 360)).astype(np.float32)
    content = BagContent(
        poses=PoseStream(stamps_ns=stamps, poses=poses, twists=twists),
        commands=CommandStream(stamps_ns=stamps, commands=twists),
        scans=ScanStream(
            stamps_ns=stamps[::4],
            ranges=ranges,
            angles=angles,
            range_max=10.0,
            mount=Pose2D(0.1, 0.0, 0.0),
        ),
    )
    folder = inbox / f"site-{seed % 8}" / f"robot-{seed % 20}"
    folder.mkdir(parents=True, exist_ok=True)
    write_rosbag(folder / name, content, format="mcap")
