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

from ses_core.errors import LogError
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.extraction.extract import ExtractedScenario, extract
from ses_core.extraction.tabled_drives import split_drives
from ses_core.extraction.trajectory import Trajectory
from ses_core.fleet_settings import FleetSettings
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import GENERIC, JACKAL, LaserProfile
from ses_core.settings import DecoderLimits, ExtractionSettings, IngestSettings, Settings
from ses_core.worlds.deployment import Deployment
from storage.artifact_store import LocalArtifactStore
from storage.bounded_parquet import read_bounded
from storage.deployment_logs import FleetFormat, write_deployments
from storage.inbox import scan_inbox
from storage.inbox_ledger import InboxLedger
from storage.ingestion import TakenIn, take_in
from storage.log_catalogue import catalogue
from storage.log_formats import LOGS_FILE, MAP_FILE, SCANS_FILE, TRAJECTORIES_FILE
from storage.quarantine import Quarantine
from storage.table_log import TableLog
from storage.tabled_logs import read_tabled_log
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

    def scenarios(self) -> "Scenarios":
        """Give the scenarios of each log, by site, robot and name."""
        extracted: Scenarios = {}
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


Scenarios = dict[tuple[object, ...], list[ExtractedScenario]]


def scenarios_by(folder: Path, log_format: FleetFormat, pose_source: Any) -> Scenarios:
    """Write the fleet in a format, take its logs in, and extract them."""
    write_fleet(folder / "inbox", log_format, drives_per_log=3, publishes_map=pose_source == "map")
    night = Night(folder / "store", IngestSettings(pose_source=pose_source))
    assert [one.status for one in night.take_in(folder / "inbox")] == ["new"] * 2
    return night.scenarios()


@pytest.fixture(scope="module")
def direct(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Scenarios]:
    return {
        source: scenarios_by(tmp_path_factory.mktemp(source), "tables", source)
        for source in ("odometry", "map")
    }


@pytest.mark.parametrize(
    ("log_format", "pose_source"),
    [("mcap", "odometry"), ("bag", "odometry"), ("db3", "odometry"), ("mcap", "map")],
)
def test_bags_and_tables_of_the_same_drives_give_identical_scenarios(
    tmp_path: Path, direct: dict[str, Scenarios], log_format: FleetFormat, pose_source: str
) -> None:
    by_bag = scenarios_by(tmp_path, log_format, pose_source)
    assert by_bag.keys() == direct[pose_source].keys()
    assert sum(len(scenarios) for scenarios in by_bag.values()) > 12
    for log, scenarios in direct[pose_source].items():
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
    log.rename(log.parent / "moved.done")
    (again,) = night.take_in(inbox)
    assert (again.status, again.log_id in {one.log_id for one in first}) == ("known", True)


def read(folder: Path, settings: IngestSettings | None = None) -> list[Trajectory]:
    """What the child does, and what is then done with it, in this process."""
    log = read_tabled_log(folder, limits=DecoderLimits())
    return split_drives(log, profile=GENERIC, settings=settings or IngestSettings())


@pytest.mark.parametrize("source", ["measured", "commanded", "derived"])
def test_the_night_s_own_settings_say_which_velocity_counts(fleet: Path, source: Any) -> None:
    drives = read(_log_in(fleet), IngestSettings(velocity_source=source))
    assert len(drives) == 3
    for drive in drives:
        if source == "derived":
            assert np.mean(np.abs(drive.speed - drive.measured[:, 0])) < 0.05
        else:
            assert np.array_equal(drive.speed, getattr(drive, source)[:, 0])


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
    log = _log_in(_one_log(tmp_path, fleet))
    rewrite(log / file, change)
    with pytest.raises(LogError, match=message) as error:
        read(log)
    assert error.value.reason == reason


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
    [(bit_flip, "checksum"), (cut_short, "truncated"), (foreign_table, "schema_conflict")],
)
def test_damaged_files_are_refused(
    tmp_path: Path, fleet: Path, damage: Callable[[Path], None], reason: str
) -> None:
    log = _log_in(_one_log(tmp_path, fleet))
    damage(log / TRAJECTORIES_FILE)
    with pytest.raises(LogError) as error:
        read(log)
    assert error.value.reason == reason


def test_a_file_that_claims_more_rows_than_fit_is_not_read(tmp_path: Path, fleet: Path) -> None:
    log = _log_in(fleet)
    limits = DecoderLimits(output_mib=1)
    with pytest.raises(LogError) as error:
        read_bounded(log / SCANS_FILE, "scans", ("ranges_m",), byte_limit=2**16)
    assert error.value.reason == "size_limit"
    assert len(read_tabled_log(log, limits=limits).lengths) == 3
    # A million equal rows take a few kilobytes.
    path = tmp_path / SCANS_FILE
    schema = pq.read_schema(log / SCANS_FILE)
    rows = pq.read_table(log / SCANS_FILE)
    pq.write_table(rows.take(np.zeros(100_000, dtype=np.int64)), path, compression="zstd")
    assert path.stat().st_size < 2**20
    with pytest.raises(LogError) as error:
        read_bounded(path, "scans", schema.names, byte_limit=2**20)
    assert error.value.reason in ("size_limit", "memory_limit")


@pytest.mark.parametrize("damage", [no_table, cut_short])
def test_a_refused_folder_goes_into_quarantine_whole(
    tmp_path: Path, fleet: Path, damage: Callable[[Path], None]
) -> None:
    inbox = _one_log(tmp_path, fleet)
    damage(_log_in(inbox) / TRAJECTORIES_FILE)
    night = Night(tmp_path / "store")
    (taken,) = night.take_in(inbox)
    reason = "bad_magic" if damage is no_table else "truncated"
    assert (taken.status, taken.reason) == ("quarantined", reason)
    (kept,) = Quarantine(night.store.layout.quarantine).entries()
    assert kept.payload is not None
    assert (kept.payload / TRAJECTORIES_FILE).is_file()
    assert catalogue(night.tables) == []


def test_a_map_is_no_way_in_for_pickles(tmp_path: Path, fleet: Path) -> None:
    log = _log_in(_one_log(tmp_path, fleet))
    objects = np.array([[{"a": 1}]], dtype=object)
    np.savez(log / MAP_FILE, cells=objects, resolution=0.1, origin=np.zeros(3), allow_pickle=True)
    with pytest.raises(LogError, match="no map") as error:
        read(log)
    assert error.value.reason == "schema_conflict"


def _log_in(inbox: Path) -> Path:
    return min(path for path in inbox.glob("*/*/*") if path.is_dir())


def _one_log(tmp_path: Path, fleet: Path) -> Path:
    shutil.copytree(_log_in(fleet), tmp_path / "inbox" / "site" / "robot" / "log")
    (tmp_path / "inbox" / "site" / "robot" / "log.done").touch()
    return tmp_path / "inbox"
