"""Logs that come as tables: taken in like bags of the same drives, and trusted as little."""

import json
import shutil
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.extraction.extract import ExtractedScenario, extract
from ses_core.fleet_settings import FleetSettings
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import GENERIC, JACKAL, LaserProfile
from ses_core.settings import ExtractionSettings, IngestSettings, Settings
from ses_core.worlds.deployment import Deployment
from storage.artifact_store import LocalArtifactStore
from storage.deployment_logs import FleetFormat, write_deployments
from storage.inbox import scan_inbox
from storage.inbox_ledger import InboxLedger
from storage.ingestion import TakenIn, take_in
from storage.log_catalogue import catalogue
from storage.log_formats import LOGS_FILE, MAP_FILE, SCANS_FILE, TRAJECTORIES_FILE
from storage.quarantine import Quarantine
from storage.table_log import TableLog
from storage.trajectory_tables import read_log_row, read_trajectories

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
        times=np.arange(steps) * 0.05,
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
        fleet=FleetSettings(**fleet),
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

    def scenarios(self) -> dict[tuple[object, ...], list[ExtractedScenario]]:
        """Give the scenarios of each log, by site, robot and name."""
        extracted = {}
        for log in catalogue(self.tables):
            folder = self.store.path(log.ref)
            row = read_log_row(folder)
            extracted[row["site"], row["robot"], str(row["name"]).removesuffix(".bag")] = extract(
                read_trajectories(folder),
                log_id="same",
                recorded_map=None,
                settings=ExtractionSettings(),
                profile=GENERIC,
                target=JACKAL,
            )
        return extracted


def compare(one: ExtractedScenario, other: ExtractedScenario) -> None:
    assert one.scenario == other.scenario
    assert one.quality == other.quality
    if one.environment is None or other.environment is None:
        assert one.environment is other.environment
        return
    assert np.array_equal(one.environment.cells, other.environment.cells)
    assert np.array_equal(one.environment.observed, other.environment.observed)


@pytest.mark.parametrize("log_format", ["mcap", "bag", "db3"])
@pytest.mark.parametrize("pose_source", ["odometry", "map"])
def test_bags_and_tables_of_the_same_drives_give_identical_scenarios(
    tmp_path: Path, log_format: FleetFormat, pose_source: Any
) -> None:
    found = []
    for name in ("tables", log_format):
        inbox = tmp_path / f"inbox-{name}"
        fleet = {"drives_per_log": 2, "publishes_map": pose_source == "map"}
        write_fleet(inbox, "tables" if name == "tables" else log_format, **fleet)
        night = Night(tmp_path / f"store-{name}", IngestSettings(pose_source=pose_source))
        taken = night.take_in(inbox)
        assert [one.status for one in taken] == ["new"] * 4
        found.append(night.scenarios())
    direct, by_bag = found
    assert direct.keys() == by_bag.keys()
    assert sum(len(scenarios) for scenarios in direct.values()) > 12
    for log, scenarios in direct.items():
        assert len(scenarios) == len(by_bag[log])
        for one, other in zip(scenarios, by_bag[log], strict=True):
            compare(one, other)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    inbox = tmp_path_factory.mktemp("fleet")
    write_fleet(inbox, "tables", publishes_map=True)
    return inbox


def test_tables_are_known_by_their_content(tmp_path: Path, fleet: Path) -> None:
    inbox = tmp_path / "inbox"
    shutil.copytree(fleet, inbox)
    night = Night(tmp_path / "store")
    first = night.take_in(inbox)
    assert {one.status for one in first} == {"new"}
    assert night.take_in(inbox) == []
    (log, *_) = sorted(inbox.glob("*/*/*.done"))
    log.with_suffix("").rename(log.parent / "moved")
    (again,) = night.take_in(inbox)
    assert (again.status, again.log_id in {one.log_id for one in first}) == ("known", True)


def test_the_night_s_own_settings_say_which_velocity_counts(tmp_path: Path, fleet: Path) -> None:
    night = Night(tmp_path / "store", IngestSettings(velocity_source="measured"))
    night.take_in(fleet)
    for log in catalogue(night.tables):
        for trajectory in read_trajectories(night.store.path(log.ref)):
            assert np.array_equal(trajectory.speed, trajectory.measured[:, 0])


Change = Callable[[dict[str, np.ndarray[Any, Any]]], None]


def rewrite(path: Path, change: Change) -> None:
    """Change columns of a file and write it as one of the same table."""
    table = pq.read_table(path)
    columns = {
        name: table[name].combine_chunks()
        if pa.types.is_list(table.schema.field(name).type)
        else np.array(table[name].to_numpy(zero_copy_only=False))
        for name in table.column_names
    }
    change(columns)
    arrays = [pa.array(columns[field.name], type=field.type) for field in table.schema]
    pq.write_table(pa.Table.from_arrays(arrays, schema=table.schema), path)


def cell(name: str, row: int, value: object) -> Change:
    def change(columns: dict[str, np.ndarray[Any, Any]]) -> None:
        columns[name][row] = value

    return change


def ragged(columns: dict[str, Any]) -> None:
    lists = columns["ranges_m"].to_pylist()
    lists[3] = lists[3][:-1]
    columns["ranges_m"] = lists


def shifted(columns: dict[str, Any]) -> None:
    columns["stamp_ns"][10:] += 1


def doubled(columns: dict[str, Any]) -> None:
    for name, values in columns.items():
        columns[name] = np.concatenate((values, values))


BROKEN: dict[str, tuple[str, Change, str, str]] = {
    "a pose that is no number": (
        TRAJECTORIES_FILE,
        cell("x_m", 7, np.nan),
        "bad_values",
        "1 of ",
    ),
    "a pose out of reach": (TRAJECTORIES_FILE, cell("y_m", 7, 1e30), "bad_values", "out of reach"),
    "a jump": (TRAJECTORIES_FILE, cell("x_m", 7, 900.0), "bad_values", "m long"),
    "another clock": (TRAJECTORIES_FILE, shifted, "bad_clock", "0.05 s apart"),
    "time running back": (TRAJECTORIES_FILE, cell("stamp_ns", 7, 5), "bad_clock", "ascend"),
    "a step twice": (TRAJECTORIES_FILE, cell("step", 7, 6), "schema_conflict", "ascend"),
    "a step before the first": (TRAJECTORIES_FILE, cell("step", 0, -1), "schema_conflict", "asc"),
    "a scan pose that is no number": (
        SCANS_FILE,
        cell("body_x_m", 2, np.inf),
        "bad_values",
        "1 of",
    ),
    "two lasers": (SCANS_FILE, cell("mount_x_m", 2, 0.3), "schema_conflict", "one laser"),
    "a laser that reaches nowhere": (
        SCANS_FILE,
        lambda columns: columns["range_max_m"].fill(-1.0),
        "bad_values",
        "laser reaches",
    ),
    "uneven scans": (SCANS_FILE, ragged, "schema_conflict", "numbers of readings"),
    "more messages used than there were": (
        LOGS_FILE,
        cell("messages_used", 0, 10**9),
        "schema_conflict",
        "cannot have been used",
    ),
    "warnings that are no counts": (
        LOGS_FILE,
        cell("warnings", 0, json.dumps({"gap": "many"})),
        "schema_conflict",
        "no counts",
    ),
    "two logs in one": (LOGS_FILE, doubled, "schema_conflict", "2 rows"),
    "no clock": (LOGS_FILE, cell("has_clock", 0, False), "bad_clock", "without a clock"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_tables_with_something_wrong_are_refused_for_it(
    tmp_path: Path, fleet: Path, name: str
) -> None:
    file, change, reason, message = BROKEN[name]
    inbox = _one_log(tmp_path, fleet)
    rewrite(inbox / "site" / "robot" / "log" / file, change)
    _require_refused(tmp_path, inbox, reason, message)


def bit_flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 4
    path.write_bytes(content)


def cut_short(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-200])


def foreign_table(path: Path) -> None:
    pq.write_table(pa.table({"step": [1, 2], "x_m": [0.5, 0.6]}), path)


def no_table(path: Path) -> None:
    path.write_bytes(b"not a table at all")


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (bit_flip, "checksum"),
        (cut_short, "truncated"),
        (foreign_table, "schema_conflict"),
        (no_table, "bad_magic"),
    ],
)
def test_damaged_files_are_refused(
    tmp_path: Path, fleet: Path, damage: Callable[[Path], None], reason: str
) -> None:
    inbox = _one_log(tmp_path, fleet)
    damage(inbox / "site" / "robot" / "log" / TRAJECTORIES_FILE)
    _require_refused(tmp_path, inbox, reason, "")


def test_a_map_is_no_way_in_for_pickles(tmp_path: Path, fleet: Path) -> None:
    inbox = _one_log(tmp_path, fleet)
    path = inbox / "site" / "robot" / "log" / MAP_FILE
    objects = np.array([[{"a": 1}]], dtype=object)
    np.savez(path, cells=objects, resolution=0.1, origin=np.zeros(3), allow_pickle=True)
    _require_refused(tmp_path, inbox, "schema_conflict", "no map")


def _one_log(tmp_path: Path, fleet: Path) -> Path:
    log = min(path for path in fleet.glob("*/*/*") if path.is_dir())
    shutil.copytree(log, tmp_path / "inbox" / "site" / "robot" / "log")
    (tmp_path / "inbox" / "site" / "robot" / "log.done").touch()
    return tmp_path / "inbox"


def _require_refused(tmp_path: Path, inbox: Path, reason: str, message: str) -> None:
    night = Night(tmp_path / "store")
    (taken,) = night.take_in(inbox)
    assert (taken.status, taken.reason) == ("quarantined", reason)
    assert message in taken.message
    (kept,) = Quarantine(night.store.layout.quarantine).entries()
    assert kept.payload is not None
    assert (kept.payload / TRAJECTORIES_FILE).is_file()
    assert catalogue(night.tables) == []
