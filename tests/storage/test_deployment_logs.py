from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from ses_core.errors import WorldError
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.extraction.resampling import resample
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import JACKAL
from ses_core.settings import DecoderLimits, IngestSettings
from ses_core.worlds.deployment import Deployment
from storage.deployment_logs import FleetFormat, FleetLog, write_deployments
from storage.rosbag_logs import RosbagLogReader
from storage.trajectory_tables import read_log_row, read_trajectories

DAY = date(2026, 11, 22)
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


def _write(out: Path, log_format: FleetFormat) -> list[FleetLog]:
    # As they end, not as they began.
    deployments = [_deployment(number) for number in (2, 0, 3, 1)]
    return write_deployments(
        out, deployments, tasks=TASKS, format=log_format, profile=JACKAL, day=DAY
    )


def test_sites_are_worlds_and_robots_take_turns(tmp_path: Path) -> None:
    logs = {log.number: log for log in _write(tmp_path, "mcap")}
    assert [logs[number].robot for number in range(4)] == [
        "jackal-1",
        "jackal-2",
        "jackal-1",
        "jackal-1",
    ]
    assert [logs[number].site for number in range(4)] == ["home-1"] * 3 + [".._odd_site"]
    for log in logs.values():
        assert log.path.parent == tmp_path / log.site / log.robot
        assert log.path.with_name(f"{log.path.name}.done").is_file()
    first, second = logs[0].path.name, logs[2].path.name
    assert (first[:19], second[:19]) == ("2026-11-22T06-00-00", "2026-11-22T06-02-30")


@pytest.mark.parametrize("log_format", ["mcap", "db3", "bag"])
def test_rosbags_reads_back_the_values_written(tmp_path: Path, log_format: FleetFormat) -> None:
    log = next(log for log in _write(tmp_path, log_format) if log.number == 0)
    written = _deployment(0)
    start = int(datetime(2026, 11, 22, 6, tzinfo=UTC).timestamp()) * 10**9
    odometry, commands, count = [], [], 0
    scans: list[tuple[int, Any]] = []
    with AnyReader([log.path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, stamp, data in reader.messages():
            count += 1
            message: Any = reader.deserialize(data, connection.msgtype)
            if connection.topic == "/odom":
                position = message.pose.pose.position
                odometry.append((stamp, position.x, position.y, message.twist.twist.linear.x))
            elif connection.topic == "/cmd_vel":
                commands.append((message.linear.x, message.angular.z))
            elif connection.topic == "/scan":
                scans.append((stamp, message))
    assert count == log.messages
    stamps = start + np.rint(written.times * 1e9).astype(np.int64)
    assert [row[0] for row in odometry] == stamps.tolist()
    assert np.allclose(
        [row[1:] for row in odometry],
        np.column_stack((written.odometry[:, :2], written.measured[:, 0])),
    )
    assert np.allclose(commands, written.commands)
    assert [stamp for stamp, _ in scans] == stamps[written.scan_steps].tolist()
    for (_, message), ranges in zip(scans, written.ranges, strict=True):
        assert np.array_equal(message.ranges, ranges)
        assert message.angle_min == pytest.approx(-2.35619)


def test_the_mcap_library_reads_the_same_messages(tmp_path: Path) -> None:
    log = next(log for log in _write(tmp_path, "mcap") if log.number == 1)
    file = next(log.path.glob("*.mcap"))
    with file.open("rb") as stream:
        topics = [channel.topic for _, channel, _ in make_reader(stream).iter_messages()]
    assert len(topics) == log.messages
    assert topics.count("/scan") == 16
    assert topics.count("/cmd_vel") == 60
    assert {"/odom", "/tf", "/tf_static", "/goal_pose"} < set(topics)


def test_tables_hold_what_ingest_would_have_made(tmp_path: Path) -> None:
    log = next(log for log in _write(tmp_path, "tables") if log.number == 0)
    row = read_log_row(log.path)
    assert (row["robot"], row["site"], row["format"]) == ("jackal-1", "home-1", "tables")
    (trajectory,) = read_trajectories(log.path)
    written = _deployment(0)
    assert np.allclose(trajectory.poses, written.odometry, atol=1e-6)
    assert int(np.sum(trajectory.speed < 0.0)) == 10


@pytest.mark.parametrize("log_format", ["mcap", "db3", "bag"])
def test_tables_and_bags_give_the_same_trajectories(
    tmp_path: Path, log_format: FleetFormat
) -> None:
    tables, bags = (
        {log.number: log.path for log in _write(tmp_path / kind, kind)}
        for kind in ("tables", log_format)
    )
    reader = RosbagLogReader(limits=DecoderLimits(), workdir=tmp_path)
    recording = reader.read(bags[0], profile=JACKAL, pose_source="odometry")
    (decoded,) = resample(recording, profile=JACKAL, settings=IngestSettings())
    (direct,) = read_trajectories(tables[0])
    assert decoded.stamps_ns.tolist() == direct.stamps_ns.tolist()
    assert np.allclose(decoded.poses, direct.poses, atol=1e-9)
    assert np.array_equal(decoded.speed, direct.speed)
    assert np.allclose(decoded.commanded, direct.commanded)
    assert decoded.scans is not None
    assert direct.scans is not None
    assert np.array_equal(decoded.scans.ranges, direct.scans.ranges)
    assert recording.warnings == {}


def test_a_log_is_never_written_over(tmp_path: Path) -> None:
    _write(tmp_path, "mcap")
    with pytest.raises(WorldError, match="is already there"):
        _write(tmp_path, "mcap")
