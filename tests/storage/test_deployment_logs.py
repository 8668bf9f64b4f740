from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, date, datetime
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from pydantic import ValidationError
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from ses_core.errors import WorldError
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.extraction.recording import Recording
from ses_core.extraction.resampling import resample
from ses_core.fleet_settings import FleetSettings
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import GENERIC
from ses_core.settings import DecoderLimits, IngestSettings, Settings, SimulationSettings
from ses_core.worlds.deployment import Deployment
from storage import rosbag_writer, trajectory_tables
from storage.deployment_logs import FleetFormat, FleetLog, write_deployments
from storage.inbox import InboxScan, scan_inbox
from storage.inbox_ledger import InboxLedger
from storage.rosbag_logs import RosbagLogReader
from storage.trajectory_tables import read_log_row, read_trajectories

DAY = date(2026, 11, 22)
SETTINGS = Settings()
WORLDS = [
    World(
        world_id=name,
        grid=OccupancyGrid(cells=np.zeros((60, 60), dtype=np.bool_), resolution=0.1),
    )
    for name in ("home-1", "../odd site")
]
TASKS = [
    NavigationTask(world=world, start=Pose2D(1.0, 1.0, 0.5), goal=(4.0, 5.0))
    for world in (WORLDS[0], WORLDS[0], WORLDS[0], WORLDS[1])
]


def _deployment(number: int) -> Deployment:
    """A drive of 3 s with a moment of reversing; only its records matter here."""
    rng = np.random.default_rng(number)
    steps = 61
    commands = np.column_stack((np.full(steps - 1, 0.5), rng.normal(0.0, 0.2, steps - 1)))
    commands[20:30, 0] = -0.5
    x = np.concatenate(([0.0], np.cumsum(commands[:, 0] * 0.05)))
    odometry = np.column_stack((x, np.zeros(steps), np.linspace(0.0, 0.1, steps)))
    ranges = rng.uniform(0.2, 9.0, (16, 720)).round(3).astype(np.float32)
    ranges[:, 5] = np.inf
    return Deployment(
        number=number,
        task=TASKS[number],
        seed=number,
        outcome=EpisodeOutcome.SUCCESS,
        times=np.arange(steps, dtype=np.float64) * 0.05,
        poses=odometry + 1.0,
        odometry=odometry,
        measured=np.vstack(([0.0, 0.0], commands)),
        commands=commands,
        scan_steps=np.arange(0, steps, 4),
        ranges=ranges,
    )


def _write(
    out: Path, log_format: FleetFormat, fleet: FleetSettings = SETTINGS.fleet
) -> list[FleetLog]:
    # As they end, not as they began.
    deployments = [_deployment(number) for number in (2, 0, 3, 1)]
    settings = Settings(fleet=fleet)
    return write_deployments(
        out, deployments, tasks=TASKS, format=log_format, day=DAY, settings=settings
    )


def _read(log: Path) -> Recording:
    reader = RosbagLogReader(limits=DecoderLimits(), workdir=log.parent)
    return reader.read(log, profile=GENERIC, pose_source="odometry")


def test_sites_are_worlds_and_robots_take_turns(tmp_path: Path) -> None:
    logs = {log.numbers: log for log in _write(tmp_path, "mcap")}
    assert [logs[number,].robot for number in range(4)] == [
        "jackal-1",
        "jackal-2",
        "jackal-1",
        "jackal-1",
    ]
    # A name that begins with a dot would be hidden from the inbox.
    assert [logs[number,].site for number in range(4)] == ["home-1"] * 3 + ["_._odd_site"]
    for log in logs.values():
        assert log.path.parent == tmp_path / log.site / log.robot
        assert log.path.with_name(f"{log.path.name}.done").is_file()
    first, second = logs[0,].path.name, logs[2,].path.name
    assert (first[:19], second[:19]) == ("2026-11-22T06-00-00", "2026-11-22T06-02-30")


@pytest.mark.parametrize("log_format", ["mcap", "db3", "bag"])
def test_rosbags_reads_back_the_values_written(tmp_path: Path, log_format: FleetFormat) -> None:
    log = next(log for log in _write(tmp_path, log_format) if log.numbers == (0,))
    written = _deployment(0)
    odometry, commands = [], []
    scans: list[Any] = []
    with AnyReader([log.path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, _, data in reader.messages():
            message: Any = reader.deserialize(data, connection.msgtype)
            if connection.topic == "/odom":
                position = message.pose.pose.position
                odometry.append((position.x, position.y, message.twist.twist.linear.x))
            elif connection.topic == "/cmd_vel":
                commands.append((message.linear.x, message.angular.z))
            elif connection.topic == "/scan":
                scans.append(message)
    assert np.allclose(odometry, np.column_stack((written.odometry[:, :2], written.measured[:, 0])))
    assert np.allclose(commands, written.commands)
    for message, ranges in zip(scans, written.ranges, strict=True):
        assert np.array_equal(message.ranges, ranges)
        assert message.angle_min == pytest.approx(-2.35619)
        assert message.range_min == pytest.approx(0.1)


def test_messages_are_recorded_a_little_after_their_stamps_and_never_on_the_beat(
    tmp_path: Path,
) -> None:
    log = next(log for log in _write(tmp_path, "mcap") if log.numbers == (0,))
    planned = int(datetime(2026, 11, 22, 6, tzinfo=UTC).timestamp()) * 10**9
    found: dict[str, list[tuple[int, int]]] = {}
    order = []
    with AnyReader([log.path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, recorded, data in reader.messages():
            order.append(connection.topic)
            message: Any = reader.deserialize(data, connection.msgtype)
            first = message.transforms[0] if connection.topic.startswith("/tf") else message
            if connection.topic != "/cmd_vel":
                stamp = first.header.stamp.sec * 10**9 + first.header.stamp.nanosec
                found.setdefault(connection.topic, []).append((stamp, recorded))
    assert order[:2] == ["/tf_static", "/goal_pose"]
    assert planned < found["/odom"][0][0] < planned + 2_100_000_000
    for topic, typical_ms in (("/odom", 0.6), ("/scan", 3.0), ("/tf", 0.3)):
        stamps, recorded = np.array(found[topic]).T
        delays = (recorded - stamps) * 1e-6
        assert 0.0 < delays.min() < delays.max() < 15.0
        assert np.median(delays) == pytest.approx(typical_ms, rel=0.6)
        intervals = np.diff(recorded)
        assert len(np.unique(intervals)) == len(intervals)
        assert np.median(intervals) == pytest.approx(2e8 if topic == "/scan" else 5e7, rel=0.02)
    # Of one reading there is one stamp.
    assert [stamp for stamp, _ in found["/tf"]] == [stamp for stamp, _ in found["/odom"]]


def test_the_mcap_library_reads_the_same_messages(tmp_path: Path) -> None:
    log = next(log for log in _write(tmp_path, "mcap") if log.numbers == (1,))
    file = next(log.path.glob("*.mcap"))
    with file.open("rb") as stream:
        topics = [channel.topic for _, channel, _ in make_reader(stream).iter_messages()]
    counts = {"/scan": 16, "/cmd_vel": 60, "/odom": 61, "/tf": 61, "/tf_static": 1, "/goal_pose": 1}
    assert Counter(topics) == counts


def test_tables_hold_what_ingest_would_have_made(tmp_path: Path) -> None:
    log = next(log for log in _write(tmp_path, "tables") if 0 in log.numbers)
    row = read_log_row(log.path)
    assert (row["robot"], row["site"], row["format"]) == ("jackal-1", "home-1", "tables")
    # By default one log holds the robot's day.
    assert log.numbers == (0, 2)
    trajectory, second = read_trajectories(log.path)
    written = _deployment(0)
    assert np.allclose(trajectory.poses[::10], written.odometry[:-1:10], atol=2e-3)
    assert int(np.sum(trajectory.speed < 0.0)) == 10
    assert second.first_step == len(trajectory) + 1


@pytest.mark.parametrize("log_format", ["mcap", "db3", "bag"])
@pytest.mark.parametrize("drives", [1, 2])
def test_tables_and_bags_give_the_same_trajectories_bit_by_bit(
    tmp_path: Path, log_format: FleetFormat, drives: int
) -> None:
    fleet = FleetSettings(drives_per_log=drives)
    tables, bags = (
        {log.numbers: log.path for log in _write(tmp_path / kind, kind, fleet)}
        for kind in ("tables", log_format)
    )
    assert tables.keys() == bags.keys()
    for numbers, folder in tables.items():
        recording = _read(bags[numbers])
        decoded = resample(recording, profile=GENERIC, settings=IngestSettings())
        direct = read_trajectories(folder)
        assert len(decoded) == len(direct) == len(numbers)
        for one, other in zip(decoded, direct, strict=True):
            assert one.stamps_ns.tolist() == other.stamps_ns.tolist()
            for name in ("poses", "speed", "commanded", "measured"):
                assert np.array_equal(getattr(one, name), getattr(other, name)), name
            assert one.scans is not None
            assert other.scans is not None
            assert one.scans.stamps_ns.tolist() == other.scans.stamps_ns.tolist()
            assert np.array_equal(one.scans.ranges, other.scans.ranges)
        assert recording.warnings == {}
        row = read_log_row(folder)
        assert (row["messages_in"], row["messages_used"]) == (
            recording.messages_in,
            recording.messages_used,
        )


def test_a_split_log_is_one_folder_of_files_that_everyone_reads_as_one(tmp_path: Path) -> None:
    whole = _write(tmp_path / "whole", "mcap", FleetSettings(drives_per_log=2))
    split = _write(tmp_path / "split", "mcap", FleetSettings(drives_per_log=2, split_s=1.0))
    for one, other in zip(whole, split, strict=True):
        assert len(list(other.path.glob("*.mcap"))) > 3
        assert not [path for path in other.path.parent.iterdir() if path.name.startswith(".")]
        assert np.array_equal(_read(one.path).poses.poses, _read(other.path).poses.poses)
        counts = []
        for path in (one.path, other.path):
            with AnyReader([path]) as reader:
                counts.append({name: topic.msgcount for name, topic in reader.topics.items()})
                assert sum(1 for _ in reader.messages()) == reader.message_count
        assert counts[0] == counts[1]
    with pytest.raises(WorldError, match="expected mcap or db3"):
        _write(tmp_path / "bag", "bag", FleetSettings(split_s=1.0))


def test_odometry_goes_on_where_it_was_when_the_robot_is_carried_to_its_next_start(
    tmp_path: Path,
) -> None:
    log = next(
        log
        for log in _write(tmp_path, "mcap", FleetSettings(drives_per_log=2))
        if log.numbers == (0, 2)
    )
    poses = _read(log.path).poses
    pause = int(np.argmax(np.diff(poses.stamps_ns)))
    assert pause == 60
    assert np.allclose(poses.poses[pause], poses.poses[pause + 1])
    first, second = _deployment(0).odometry, _deployment(2).odometry
    way = np.hypot(*(poses.poses[-1, :2] - poses.poses[pause + 1, :2]))
    assert way == pytest.approx(float(np.hypot(*second[-1, :2])))
    assert np.allclose(poses.poses[pause], first[-1])


def test_drives_of_a_log_stay_apart_after_the_shortest_pause(tmp_path: Path) -> None:
    with pytest.raises(ValidationError, match="pause_s"):
        FleetSettings(pause_s=9.9)
    # Every drive lasts as long as one may, and fractions of seconds are rounded in between.
    settings = Settings(
        simulation=SimulationSettings(time_limit_s=3.0),
        fleet=FleetSettings(robots_per_site=1, drives_per_log=40, pause_s=10.5),
    )
    drives = [replace(_deployment(0), number=number, seed=number) for number in range(40)]
    (log,) = write_deployments(
        tmp_path, drives, tasks=TASKS[:1] * 40, format="tables", day=DAY, settings=settings
    )
    trajectories = read_trajectories(log.path)
    assert len(trajectories) == 40
    pauses = [
        int(after.stamps_ns[0] - before.stamps_ns[-1]) * 1e-9
        for before, after in pairwise(trajectories)
    ]
    assert IngestSettings().gap_s < min(pauses) < 10.0 < max(pauses)


@pytest.mark.parametrize("kind", ["mcap", "bag"])
def test_a_published_map_is_the_world_and_places_the_odometry_in_it(
    tmp_path: Path, kind: FleetFormat
) -> None:
    logs = _write(tmp_path, kind, FleetSettings(publishes_map=True))
    log = next(log for log in logs if log.numbers == (0,))
    reader = RosbagLogReader(limits=DecoderLimits(), workdir=tmp_path)
    in_map = reader.read(log.path, profile=GENERIC, pose_source="map")
    assert in_map.map is not None
    assert np.array_equal(in_map.map.cells.astype(bool), TASKS[0].world.grid.cells)
    # Within a tick: the newest transform may be the one before.
    assert np.allclose(in_map.poses.poses, _deployment(0).poses, atol=0.05)
    # In the frame of the odometry the same cells would be somewhere else.
    by_odometry = reader.read(log.path, profile=GENERIC, pose_source="odometry")
    assert by_odometry.map is None
    assert by_odometry.warnings == {"map_of_other_frame": 1}


def test_deployments_that_break_off_leave_what_was_driven(tmp_path: Path) -> None:
    def broken() -> Iterator[Deployment]:
        yield _deployment(0)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_deployments(
            tmp_path, broken(), tasks=TASKS, format="tables", day=DAY, settings=SETTINGS
        )
    (done,) = tmp_path.rglob("*.done")
    assert len(read_trajectories(done.with_suffix(""))) == 1


def test_tables_that_were_never_finished_are_no_upload(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[InboxScan] = []

    def killed(*_: object) -> None:
        # The row of the log and its steps are on the disk.
        assert len(list(tmp_path.rglob("*.parquet"))) == 2
        found.append(_look_into(tmp_path))
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(trajectory_tables, "_write_scans", killed)
        with pytest.raises(KeyboardInterrupt):
            _write(tmp_path, "tables")
    assert {(scan.new, scan.waiting) for scan in found} == {((), ())}
    assert not list(tmp_path.rglob("*.parquet"))
    assert len(_write(tmp_path, "tables")) == len(_look_into(tmp_path).new) == 3


@pytest.mark.parametrize("log_format", ["mcap", "db3", "bag"])
def test_bags_that_were_never_finished_are_no_upload(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, log_format: FleetFormat
) -> None:
    found: list[InboxScan] = []

    def killed(streams: object) -> Iterator[object]:
        yield from islice(in_time_order(streams), 50)
        assert [file for file in tmp_path.rglob("*") if file.is_file()]
        found.append(_look_into(tmp_path))
        raise KeyboardInterrupt

    in_time_order: Any = rosbag_writer._in_time_order
    with monkeypatch.context() as patch:
        patch.setattr(rosbag_writer, "_in_time_order", killed)
        with pytest.raises(KeyboardInterrupt):
            _write(tmp_path, log_format)
    assert {(scan.new, scan.waiting) for scan in found} == {((), ())}
    assert not [file for file in tmp_path.rglob("*") if file.is_file()]
    assert len(_look_into(tmp_path).new) == 0
    assert len(_write(tmp_path, log_format)) == len(_look_into(tmp_path).new) == 4


def _look_into(inbox: Path) -> InboxScan:
    return scan_inbox(
        inbox,
        ledger=InboxLedger(inbox / "ledger"),
        settings=IngestSettings(steady_s=0.0),
        progress=lambda line: None,
    )


def test_a_log_is_never_written_over(tmp_path: Path) -> None:
    _write(tmp_path, "mcap")
    with pytest.raises(WorldError, match="is already there"):
        _write(tmp_path, "mcap")
