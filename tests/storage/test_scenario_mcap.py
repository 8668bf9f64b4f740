"""Scenarios as MCAP: what rosbags, the `mcap` library and our own decoder read from them."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from ses_core.arrays import FloatArray
from ses_core.extraction.extract import ExtractedScenario
from ses_core.extraction.reconstruction import scenario_frame
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import (
    Pose2D,
    compose,
    compose_all,
    from_frame,
    inverse,
    wrap_angle,
    wrap_angles,
)
from ses_core.navigation import NavigationEnvironment
from ses_core.place import place_of_environment
from ses_core.robot_profile import GENERIC
from ses_core.settings import DecoderLimits
from storage.log_decoder import decode_log
from storage.log_formats import ROSBAG2_MCAP
from storage.message_types import ros2_types
from storage.scenario_mcap import PLACE_STAMP_NS, write_place_mcap, write_scenario_mcap
from tests.ses_core.pictures.pictured import drive, extracted

START_NS = 1_700_000_000 * 10**9
MOUNT, ODOMETRY = Pose2D(0.1, -0.02, 0.4), Pose2D(3.0, -7.0, 2.2)
CLOCK_START_NS = 1_795_000_000 * 10**9
TOPICS = {
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/odom": "nav_msgs/msg/Odometry",
    "/cmd_vel": "geometry_msgs/msg/Twist",
    "/scan": "sensor_msgs/msg/LaserScan",
    "/map": "nav_msgs/msg/OccupancyGrid",
    "/path": "nav_msgs/msg/Path",
    "/markers": "visualization_msgs/msg/MarkerArray",
}


@pytest.fixture(scope="module")
def driven() -> tuple[ExtractedScenario, Trajectory]:
    trajectory = askew(drive(reversing=True))
    (first, *_) = extracted(trajectory)
    return first, trajectory


def askew(trajectory: Trajectory) -> Trajectory:
    """Turn the odometry frame, mount the laser askew and set the clock: each frame shows."""
    assert trajectory.scans is not None
    assert trajectory.scan_poses is not None

    def moved(lasers: FloatArray) -> FloatArray:
        turned = compose_all(lasers, inverse(MOUNT))
        points = from_frame(turned[:, :2], ODOMETRY)
        return np.column_stack((points, wrap_angles(turned[:, 2] + ODOMETRY.yaw)))

    scans = trajectory.scans
    return replace(
        trajectory,
        stamps_ns=trajectory.stamps_ns + START_NS,
        poses=moved(trajectory.poses),
        scan_poses=moved(trajectory.scan_poses),
        scans=replace(scans, stamps_ns=scans.stamps_ns + START_NS, mount=MOUNT),
        commanded=np.column_stack((trajectory.speed, np.zeros(len(trajectory)))),
    )


@pytest.fixture(scope="module")
def written(
    driven: tuple[ExtractedScenario, Trajectory], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    path = tmp_path_factory.mktemp("mcap") / "deeper" / "scenario.mcap"
    write(path, *driven)
    return path


def write(path: Path, scenario: ExtractedScenario, trajectory: Trajectory) -> None:
    write_scenario_mcap(path, scenario, trajectory, scan_margin=1.0, clock_start_ns=CLOCK_START_NS)


def messages(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Decode everything with rosbags and the definitions that the file itself brings along."""
    found: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([path]) as reader:
        for connection, stamp, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            found.setdefault(connection.topic, []).append((stamp, message))
    return found


def pose_of(pose: Any) -> Pose2D:
    place = pose.translation if hasattr(pose, "translation") else pose.position
    turn = pose.rotation if hasattr(pose, "rotation") else pose.orientation
    return Pose2D(place.x, place.y, 2.0 * np.arctan2(turn.z, turn.w))


def transforms(found: dict[str, list[tuple[int, Any]]], child: str) -> Iterator[tuple[int, Any]]:
    for stamp, message in found["/tf"] + found["/tf_static"]:
        for transform in message.transforms:
            if transform.child_frame_id == child:
                yield stamp, transform


def test_both_libraries_read_every_topic(written: Path) -> None:
    with written.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        header, summary = reader.get_header(), reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        by_mcap: dict[str, list[tuple[int, bytes]]] = {}
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            assert schema.encoding == "ros2msg"
            assert channel.message_encoding == "cdr"
            assert TOPICS[channel.topic] == schema.name
            by_mcap.setdefault(channel.topic, []).append((message.log_time, message.data))
    assert header.profile == "ros2"
    # Foxglove finds its way by the index.
    assert len(summary.chunk_indexes) == summary.statistics.chunk_count >= 1
    assert summary.statistics.message_count == sum(map(len, by_mcap.values()))
    assert set(by_mcap) == set(TOPICS)
    with AnyReader([written]) as bag:
        by_rosbags: dict[str, list[tuple[int, bytes]]] = {}
        for connection, stamp, raw in bag.messages():
            by_rosbags.setdefault(connection.topic, []).append((stamp, bytes(raw)))
    assert by_rosbags == by_mcap


def test_definitions_are_complete(written: Path) -> None:
    # A store that knows nothing learns every type from the file alone, and decodes with it.
    with written.open("rb") as stream:
        reader = make_reader(stream)
        types = get_typestore(Stores.EMPTY)
        known: set[str] = set()
        for schema, _, message in reader.iter_messages():
            assert schema is not None
            if schema.name not in known:
                text = schema.data.decode()
                learned = get_types_from_msg(text, schema.name)
                types.register(
                    {
                        name: fields
                        for name, fields in learned.items()
                        if name not in types.fielddefs
                    }
                )
                known.add(schema.name)
            ours = ros2_types().deserialize_cdr(message.data, schema.name)
            theirs = types.deserialize_cdr(message.data, schema.name)
            assert repr(ours) == repr(theirs)
    assert known == set(TOPICS.values())


def test_the_grid_lies_where_the_robot_drove(
    written: Path, driven: tuple[ExtractedScenario, Trajectory]
) -> None:
    scenario, _ = driven
    assert scenario.environment is not None
    found = messages(written)
    ((_, grid),) = found["/map"]
    place = place_of_environment(scenario.environment)
    data = np.asarray(grid.data).reshape(grid.info.height, grid.info.width)
    assert grid.header.frame_id == "map"
    assert np.array_equal(data == 100, place.grid.cells)
    assert np.array_equal(data == -1, ~place.observed & ~place.grid.cells)
    assert grid.info.resolution == pytest.approx(place.grid.resolution)
    origin = pose_of(grid.info.origin)
    assert (origin.x, origin.y, origin.yaw) == (0.0, -2.5, 0.0)
    # Scan after scan, most ends of beams within the grid lie in occupied cells: every frame
    # between the laser and the map is right.
    mount = next(pose_of(one.transform) for _, one in transforms(found, "laser"))
    to_map = {stamp: pose_of(one.transform) for stamp, one in transforms(found, "odom")}
    bodies = {stamp: pose_of(one.transform) for stamp, one in transforms(found, "base_link")}
    assert set(to_map) == set(bodies)
    stamps = np.array(sorted(bodies))
    inside, hits = 0, 0
    for stamp, scan in found["/scan"]:
        near = int(stamps[np.abs(stamps - stamp).argmin()])
        laser = compose(compose(to_map[near], bodies[near]), mount)
        angles = laser.yaw + scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        is_hit = np.isfinite(scan.ranges) & (scan.ranges < scan.range_max)
        ends = np.column_stack(
            (laser.x + scan.ranges * np.cos(angles), laser.y + scan.ranges * np.sin(angles))
        )[is_hit]
        cells = np.floor((ends - (origin.x, origin.y)) / grid.info.resolution).astype(int)
        cells = cells[((cells >= 0) & (cells < 30)).all(axis=1)]
        inside += len(cells)
        hits += int((data[cells[:, 1], cells[:, 0]] == 100).sum())
    assert inside > 1000
    assert hits > 0.95 * inside


def test_the_path_begins_at_the_origin_and_markers_stand_on_it(
    written: Path, driven: tuple[ExtractedScenario, Trajectory]
) -> None:
    scenario, trajectory = driven
    found = messages(written)
    ((_, path),) = found["/path"]
    ((_, markers),) = found["/markers"]
    points = np.array([(one.pose.position.x, one.pose.position.y) for one in path.poses])
    by_name = {one.ns: one for one in markers.markers}
    assert set(by_name) == {"start", "goal", "reversing"}
    steps = scenario.scenario.last_step - scenario.scenario.first_step + 1
    assert len(points) == steps
    np.testing.assert_allclose(points[0], (0.0, 0.0), atol=1e-9)
    goal = by_name["goal"].pose.position
    np.testing.assert_allclose(points[-1], (goal.x, goal.y), atol=1e-9)
    assert goal.x > 5.0
    assert abs(goal.y) < 1e-9
    first = scenario.scenario.first_step - trajectory.first_step
    backwards = trajectory.speed[first : first + steps] < 0.0
    spots = np.array([(one.x, one.y) for one in by_name["reversing"].points])
    np.testing.assert_allclose(spots, points[backwards])
    heading = pose_of(by_name["start"].pose).yaw
    frame = scenario_frame(scenario.scenario)
    assert heading == pytest.approx(wrap_angle(scenario.scenario.start.yaw - frame.yaw))


def test_our_own_decoder_reads_the_drive_back(
    written: Path, driven: tuple[ExtractedScenario, Trajectory], tmp_path: Path
) -> None:
    scenario, trajectory = driven
    recording = decode_log(
        written,
        format=ROSBAG2_MCAP,
        profile=GENERIC,
        pose_source="odometry",
        limits=DecoderLimits(),
        workdir=tmp_path,
    )
    kept = np.isin(trajectory.stamps_ns, recording.poses.stamps_ns)
    assert len(recording.poses.stamps_ns) == kept.sum()
    np.testing.assert_allclose(recording.poses.poses, trajectory.poses[kept])
    assert recording.scans is not None
    assert trajectory.scans is not None
    seen = np.isin(trajectory.scans.stamps_ns, recording.scans.stamps_ns)
    assert len(recording.scans.stamps_ns) == seen.sum()
    np.testing.assert_array_equal(recording.scans.ranges, trajectory.scans.ranges[seen])
    margin = 10**9
    start = scenario.scenario.start_stamp_ns
    assert recording.poses.stamps_ns[0] >= start - margin
    end = start + scenario.scenario.duration_s * 1e9 + margin
    assert recording.poses.stamps_ns[-1] <= end


def test_a_drive_without_clock_gets_stamps_of_its_day(
    driven: tuple[ExtractedScenario, Trajectory], tmp_path: Path
) -> None:
    scenario, trajectory = driven
    begin = int(trajectory.stamps_ns[0])
    assert trajectory.scans is not None
    clockless = replace(
        trajectory,
        has_clock=False,
        stamps_ns=trajectory.stamps_ns - begin,
        scans=replace(trajectory.scans, stamps_ns=trajectory.scans.stamps_ns - begin),
    )
    moved = replace(
        scenario,
        scenario=replace(
            scenario.scenario, start_stamp_ns=scenario.scenario.start_stamp_ns - begin
        ),
    )
    write(tmp_path / "a.mcap", moved, clockless)
    found = messages(tmp_path / "a.mcap")
    assert min(stamp for stream in found.values() for stamp, _ in stream) == CLOCK_START_NS
    write(tmp_path / "b.mcap", scenario, trajectory)
    assert len(found["/scan"]) == len(messages(tmp_path / "b.mcap")["/scan"]) > 0


def test_a_scenario_without_place_scans_or_commands_still_shows_its_way(
    driven: tuple[ExtractedScenario, Trajectory], tmp_path: Path
) -> None:
    scenario, trajectory = driven
    unknown = np.full_like(trajectory.commanded, np.nan)
    bare = replace(trajectory, scans=None, scan_poses=None, commanded=unknown)
    write(tmp_path / "a.mcap", replace(scenario, environment=None, quality=None), bare)
    assert set(messages(tmp_path / "a.mcap")) == {"/tf", "/odom", "/path", "/markers"}


def test_equal_scenarios_give_equal_bytes_and_leave_nothing_else(
    driven: tuple[ExtractedScenario, Trajectory], written: Path, tmp_path: Path
) -> None:
    write(tmp_path / "scenario.mcap", *driven)
    write(tmp_path / "scenario.mcap", *driven)
    assert (tmp_path / "scenario.mcap").read_bytes() == written.read_bytes()
    assert [file.name for file in tmp_path.iterdir()] == ["scenario.mcap"]


def test_a_place_alone_is_its_grid_and_its_markers(tmp_path: Path) -> None:
    cells = np.random.default_rng(4).random((30, 30)) < 0.3
    place = place_of_environment(
        NavigationEnvironment(
            environment_id="e", cells=cells, observed=np.ones_like(cells), origin="gan"
        )
    )
    write_place_mcap(tmp_path / "a.mcap", place)
    found = messages(tmp_path / "a.mcap")
    ((stamp, grid),) = found["/map"]
    ((_, markers),) = found["/markers"]
    assert stamp == PLACE_STAMP_NS
    assert np.array_equal(np.asarray(grid.data).reshape(30, 30) == 100, place.grid.cells)
    assert [one.ns for one in markers.markers] == ["start", "goal"]
    bare = replace(place, start=None, goal=None)
    write_place_mcap(tmp_path / "b.mcap", bare)
    ((_, markers),) = messages(tmp_path / "b.mcap")["/markers"]
    assert markers.markers == []
