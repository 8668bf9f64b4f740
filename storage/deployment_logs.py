"""A simulated fleet's deployments as the logs a real fleet would have left in an inbox.

Logs lie in `<out>/<site>/<robot>/`: a site is a world, its robots take turns, and a log holds one
drive or several of a robot's day. The nightly run cannot tell these logs from a robot's.
"""

import shutil
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from pathlib import Path
from typing import Literal

from ses_core.errors import WorldError
from ses_core.extraction.resampling import find_cuts, resample, velocity_source
from ses_core.extraction.robot_matching import Identity, profile_of
from ses_core.navigation import NavigationTask
from ses_core.recipes import digest_json
from ses_core.settings import IngestSettings, Settings
from ses_core.worlds.deployment import Deployment
from storage.bag_messages import BagContent
from storage.deployment_content import content_of
from storage.durable_files import (
    make_folder,
    sync_file,
    sync_folder,
    temporary_name,
    write_if_absent,
)
from storage.log_formats import TABLES
from storage.rosbag_writer import write_rosbag
from storage.trajectory_tables import LogDescription, write_ingested
from storage.unwritten_bags import recording_of

FleetFormat = Literal["mcap", "db3", "bag", "tables"]

_DAY_STARTS = time(6, 0, tzinfo=UTC)
_DRIVES_IN_TABLES = 50
"""In tables a log holds up to this many drives: files of a few hundred rows are slow to read."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FleetLog:
    """A log that was written: where, and for which deployments."""

    path: Path
    numbers: tuple[int, ...]
    site: str
    robot: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shift:
    """Which robot drives a task, where, and as its how-manieth that day."""

    site: str
    robot: str
    turn: int


@dataclass(frozen=True, slots=True)
class _LogKey:
    """One log: a robot's n-th of the day."""

    site: str
    robot: str
    part: int


def write_deployments(
    out: Path,
    deployments: Iterable[Deployment],
    *,
    tasks: Sequence[NavigationTask],
    format: FleetFormat,  # noqa: A002 - the contract's word
    day: date,
    settings: Settings,
) -> list[FleetLog]:
    """Write deployments of these tasks as they come.

    A log is written when its last drive is over, and is complete before its `.done` sidecar
    appears. Drives of one world should follow each other: what waits for the rest of its log is
    kept in memory. If the deployments end early, what they left is written all the same.

    Raises:
        WorldError: A log of that name is already there, or ROS 1 bags were to be split.
    """
    if settings.fleet.split_s is not None and format not in ("mcap", "db3"):
        raise WorldError(f"found format {format} to split, expected mcap or db3")
    shifts = _shifts(
        tasks,
        robot=settings.target_robot.name,
        robots_per_site=settings.fleet.robots_per_site,
    )
    writer = _LogWriter(out, format=format, day=day, settings=settings)
    return list(writer.write(deployments, shifts))


class _LogWriter:
    """Collects the drives of each log, and writes the log when it has them all."""

    def __init__(
        self,
        out: Path,
        *,
        format: FleetFormat,  # noqa: A002 - the contract's word
        day: date,
        settings: Settings,
    ) -> None:
        self._out = out
        self._format: FleetFormat = format
        self._day = day
        self._settings = settings
        fleet = settings.fleet
        by_default = _DRIVES_IN_TABLES if format == TABLES else 1
        self._drives_per_log = fleet.drives_per_log or by_default
        self._spacing = timedelta(seconds=settings.simulation.time_limit_s + fleet.pause_s)

    def write(
        self, deployments: Iterable[Deployment], shifts: Sequence[_Shift]
    ) -> Iterator[FleetLog]:
        expected = Counter(self._key(shift) for shift in shifts)
        collected: dict[_LogKey, list[Deployment]] = {}
        try:
            for deployment in deployments:
                key = self._key(shifts[deployment.number])
                drives = collected.setdefault(key, [])
                drives.append(deployment)
                if len(drives) == expected[key]:
                    yield self._write_log(key, collected.pop(key), shifts)
        finally:
            for key, drives in collected.items():
                self._write_log(key, drives, shifts)

    def _key(self, shift: _Shift) -> _LogKey:
        return _LogKey(shift.site, shift.robot, shift.turn // self._drives_per_log)

    def _write_log(
        self, key: _LogKey, drives: list[Deployment], shifts: Sequence[_Shift]
    ) -> FleetLog:
        drives = sorted(drives, key=lambda deployment: deployment.number)
        starts = [self._start(shifts[deployment.number]) for deployment in drives]
        name = f"{starts[0]:%Y-%m-%dT%H-%M-%S}_{drives[0].number:05d}"
        suffix = ".bag" if self._format == "bag" else ""
        path = self._out / key.site / key.robot / f"{name}{suffix}"
        if path.exists():
            raise WorldError(f"{path} is already there, expected a folder without it")
        make_folder(path.parent)
        content = content_of(
            drives,
            [round(start.timestamp()) * 10**9 for start in starts],
            profile=self._settings.target_robot,
            publishes_map=self._settings.fleet.publishes_map,
        )
        if self._format == "tables":
            identity = Identity(key.site, key.robot)
            write_tables(path, content, identity, day=self._day, settings=self._settings.ingest)
        else:
            with _whole_log(path) as unfinished:
                split_s = self._settings.fleet.split_s
                write_rosbag(unfinished, content, format=self._format, split_s=split_s)
        write_if_absent(path.with_name(f"{path.name}.done"), b"")
        numbers = tuple(deployment.number for deployment in drives)
        return FleetLog(path=path, numbers=numbers, site=key.site, robot=key.robot)

    def _start(self, shift: _Shift) -> datetime:
        return datetime.combine(self._day, _DAY_STARTS) + shift.turn * self._spacing


def write_tables(
    path: Path, content: BagContent, identity: Identity, *, day: date, settings: IngestSettings
) -> None:
    """Write what ingest would have made of a bag with this content, without the bag."""
    profile = profile_of(identity, path.name, settings)
    recording = recording_of(content, profile=profile, pose_source=settings.pose_source)
    cuts = find_cuts(recording, profile=profile, settings=settings)
    description = LogDescription(
        log_id=digest_json(["deployment", identity.site, identity.robot, path.name]),
        name=path.name,
        robot=identity.robot,
        site=identity.site,
        format=TABLES,
        batch_date=day,
        profile=profile.name,
        velocity_source=velocity_source(recording, settings),
    )
    with _whole_log(path) as unfinished:
        unfinished.mkdir()
        write_ingested(
            unfinished,
            description,
            recording,
            resample(recording, profile=profile, settings=settings),
            cut_counts={"dropouts": int(cuts.is_gap.sum()), "pose_jumps": int(cuts.is_jump.sum())},
        )


@contextmanager
def _whole_log(path: Path) -> Iterator[Path]:
    """Give a place for a file or folder, which is moved to its own when it is whole.

    The place lies in a hidden folder, which inboxes pass over, and has the log's name already:
    ROS 2 bags name the files in them after themselves.
    """
    make_folder(path.parent)
    hidden = temporary_name(path)
    hidden.mkdir()
    try:
        unfinished = hidden / path.name
        yield unfinished
        for file in (unfinished, *unfinished.glob("*")):
            if file.is_file():
                sync_file(file)
        if unfinished.is_dir():
            sync_folder(unfinished)
        unfinished.rename(path)
    finally:
        shutil.rmtree(hidden, ignore_errors=True)
    sync_folder(path.parent)


def _shifts(tasks: Sequence[NavigationTask], *, robot: str, robots_per_site: int) -> list[_Shift]:
    """Let a site's robots take turns at its tasks."""
    driven: Counter[str] = Counter()
    shifts = []
    for task in tasks:
        site = _plain_name(task.world.world_id)
        turn, number = divmod(driven[site], robots_per_site)
        shifts.append(_Shift(site=site, robot=f"{robot}-{number + 1}", turn=turn))
        driven[site] += 1
    return shifts


def _plain_name(name: str) -> str:
    """Keep what every file system and every log's rule for names can bear; hidden is none."""
    plain = "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in name)
    return f"_{plain[1:]}" if plain.startswith(".") else plain
