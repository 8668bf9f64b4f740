"""A fleet of two sites as logs in an inbox, and a night that takes them in."""

import shutil
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.extraction.tabled_drives import split_drives
from ses_core.extraction.trajectory import Trajectory
from ses_core.fleet_settings import FleetSettings
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import GENERIC, JACKAL, LaserProfile
from ses_core.settings import DecoderLimits, IngestSettings, Settings
from ses_core.worlds.deployment import Deployment
from storage.artifact_store import LocalArtifactStore
from storage.deployment_logs import FleetFormat, write_deployments
from storage.inbox import scan_inbox
from storage.inbox_ledger import InboxLedger
from storage.ingestion import TakenIn, take_in
from storage.table_log import TableLog
from storage.tabled_logs import read_tabled_log

DAY = date(2026, 11, 22)
BEAMS = 90
ROBOT = JACKAL.model_copy(update={"laser": LaserProfile(beams=BEAMS, mount_x_m=0.12)})
WORLDS = [
    World(
        world_id=f"home-{number}",
        grid=OccupancyGrid(cells=np.zeros((40, 50), dtype=np.bool_), resolution=0.1),
    )
    for number in (1, 2)
]
TASKS = [
    NavigationTask(world=world, start=Pose2D(1.0, 1.0, 0.5), goal=(4.0, 5.0))
    for world in WORLDS
    for _ in range(3)
]


def drive(number: int) -> Deployment:
    """Forty seconds of winding about, backing off now and then, in a room made of noise."""
    rng = np.random.default_rng(number)
    steps = 801
    speed = np.where(rng.random(20).repeat(40) < 0.15, -0.3, 0.6)
    turning = rng.normal(0.0, 0.2, 40).repeat(20)
    yaw = np.concatenate(([0.0], np.cumsum(turning * 0.05)))
    x = np.concatenate(([0.0], np.cumsum(speed * 0.05 * np.cos(yaw[:-1]))))
    y = np.concatenate(([0.0], np.cumsum(speed * 0.05 * np.sin(yaw[:-1]))))
    commands = np.column_stack((speed, turning))
    ranges = rng.uniform(0.05, 6.0, (201, BEAMS)).astype(np.float32)
    ranges[rng.random(ranges.shape) < 0.05] = np.inf
    poses = np.column_stack((x, y, yaw))
    return Deployment(
        number=number,
        task=TASKS[number],
        seed=number,
        outcome=EpisodeOutcome.SUCCESS,
        times=np.arange(steps, dtype=np.float64) * 0.05,
        poses=poses + np.array([1.0, 2.0, 0.0]),
        odometry=poses,
        measured=np.vstack(([0.0, 0.0], commands)),
        commands=commands,
        scan_steps=np.arange(0, steps, 4),
        ranges=ranges,
    )


def write_fleet(inbox: Path, log_format: FleetFormat, **fleet: Any) -> None:
    settings = Settings(
        target_robot=ROBOT,
        fleet=FleetSettings(robots_per_site=1, **fleet),
        ingest=IngestSettings(pose_source="map" if fleet.get("publishes_map") else "odometry"),
    )
    write_deployments(
        inbox,
        [drive(number) for number in range(len(TASKS))],
        tasks=TASKS,
        format=log_format,
        day=DAY,
        settings=settings,
    )


class Night:
    """A store, and what becomes of an inbox in it."""

    def __init__(self, root: Path, settings: IngestSettings | None = None) -> None:
        self.store = LocalArtifactStore(root)
        self.tables = TableLog(self.store.layout)
        self.settings = settings or IngestSettings()

    def take_in(self, inbox: Path) -> list[TakenIn]:
        found = scan_inbox(
            inbox,
            ledger=InboxLedger(self.store.layout.ledger),
            settings=self.settings,
            progress=lambda line: None,
        )
        return [
            take_in(
                candidate,
                batch_date=DAY,
                store=self.store,
                tables=self.tables,
                settings=self.settings,
            )
            for candidate in found.new
        ]


def read(folder: Path, settings: IngestSettings | None = None) -> list[Trajectory]:
    """What the child does, and what is then done with it, in this process."""
    log = read_tabled_log(folder, limits=DecoderLimits())
    return split_drives(log, profile=GENERIC, settings=settings or IngestSettings())


def log_in(inbox: Path) -> Path:
    return min(path for path in inbox.glob("*/*/*") if path.is_dir())


def one_log(tmp_path: Path, fleet: Path) -> Path:
    shutil.copytree(log_in(fleet), tmp_path / "inbox" / "site" / "robot" / "log")
    (tmp_path / "inbox" / "site" / "robot" / "log.done").touch()
    return tmp_path / "inbox"
