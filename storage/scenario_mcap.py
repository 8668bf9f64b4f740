"""Scenarios and places as one MCAP file of ROS 2 messages, as Foxglove opens them.

The frame `map` is that of the scenario: its start is the origin, x leads to its goal. So the grid
lies straight, and an environment's other exports have the same coordinates. `odom` is the frame
that the log's poses are in.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ses_core.arrays import BoolArray
from ses_core.extraction.extract import ExtractedScenario
from ses_core.extraction.reconstruction import scans_of, scenario_frame
from ses_core.extraction.recording import CommandStream, PoseStream, RecordedMap
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import Pose2D, inverse, to_frame, wrap_angle, wrap_angles
from ses_core.place import Place, place_of_environment
from storage.bag_messages import BagContent, MessageStream, map_stream, message_streams
from storage.durable_files import disk_errors, make_folder, sync_file, sync_folder
from storage.mcap_markers import MARKERS, PATH, marker_message, path_message
from storage.rosbag_writer import write_ros2

_FREE, _OCCUPIED, _UNKNOWN = 0, 1, 2

PLACE_STAMP_NS = 946_684_800 * 10**9
"""Stamp of a place that nobody drove in, 2000-01-01: to ROS, 0 would mean the latest."""


def write_scenario_mcap(
    path: Path,
    extracted: ExtractedScenario,
    trajectory: Trajectory,
    *,
    scan_margin: float,
    clock_start_ns: int,
) -> None:
    """Write a scenario: transforms, odometry, commands, scans, path, grid and markers.

    Args:
        path: File to write, replaced if it is there.
        extracted: The scenario, with its place if it has one.
        trajectory: The drive it was cut from.
        scan_margin: Steps and scans this long [s] before and after the scenario are written too.
        clock_start_ns: Stamp [ns] of the trajectory's stamp 0, where the log had no clock.

    Raises:
        ArtifactError: The disk is full or failing.
    """
    if not trajectory.has_clock:
        extracted, trajectory = _moved_in_time(extracted, trajectory, clock_start_ns)
    scenario, environment = extracted.scenario, extracted.environment
    frame = scenario_frame(scenario)
    content = _content(extracted, trajectory, scan_margin=scan_margin)
    place = place_of_environment(environment) if environment is not None else None
    first, last = (
        step - trajectory.first_step for step in (scenario.first_step, scenario.last_step)
    )
    poses = trajectory.poses[first : last + 1]
    in_map = np.column_stack((to_frame(poses[:, :2], frame), wrap_angles(poses[:, 2] - frame.yaw)))
    stamps = trajectory.stamps_ns[first : last + 1]
    begin = int(content.poses.stamps_ns[0])
    goal = to_frame(np.array([scenario.goal]), frame)[0]
    _write_mcap(
        path,
        [
            *message_streams(replace(content, map=_recorded(place)), "cdr"),
            _single("/path", PATH, begin, path_message(in_map, stamps, stamp_ns=begin)),
            _single(
                "/markers",
                MARKERS,
                begin,
                marker_message(
                    start=Pose2D(0.0, 0.0, wrap_angle(scenario.start.yaw - frame.yaw)),
                    goal=(float(goal[0]), float(goal[1])),
                    reversing=in_map[trajectory.speed[first : last + 1] < 0.0, :2],
                    stamp_ns=begin,
                ),
            ),
        ],
    )


def write_place_mcap(path: Path, place: Place) -> None:
    """Write a place nobody drives in: its grid, and markers where to drive from and to.

    Raises:
        ArtifactError: The disk is full or failing.
    """
    recorded = _recorded(place)
    assert recorded is not None
    markers = marker_message(
        start=place.start, goal=place.goal, reversing=np.empty((0, 2)), stamp_ns=PLACE_STAMP_NS
    )
    _write_mcap(
        path,
        [
            map_stream(recorded, stamp_ns=PLACE_STAMP_NS, serialization="cdr"),
            _single("/markers", MARKERS, PLACE_STAMP_NS, markers),
        ],
    )


def _moved_in_time(
    extracted: ExtractedScenario, trajectory: Trajectory, offset_ns: int
) -> tuple[ExtractedScenario, Trajectory]:
    scans = trajectory.scans
    return (
        replace(
            extracted,
            scenario=replace(
                extracted.scenario, start_stamp_ns=extracted.scenario.start_stamp_ns + offset_ns
            ),
        ),
        replace(
            trajectory,
            stamps_ns=trajectory.stamps_ns + offset_ns,
            scans=None if scans is None else replace(scans, stamps_ns=scans.stamps_ns + offset_ns),
        ),
    )


def _content(
    extracted: ExtractedScenario, trajectory: Trajectory, *, scan_margin: float
) -> BagContent:
    """Give what the robot did and saw during a scenario and a margin [s] around it."""
    scenario = extracted.scenario
    chosen = scans_of(trajectory, scenario, margin=scan_margin)
    margin_ns = round(scan_margin * 1e9)
    end = trajectory.stamps_ns[scenario.last_step - trajectory.first_step] + margin_ns
    steps: BoolArray = (trajectory.stamps_ns >= scenario.start_stamp_ns - margin_ns) & (
        trajectory.stamps_ns <= end
    )
    stamps = trajectory.stamps_ns[steps]
    commanded = trajectory.commanded[steps]
    is_commanded = np.isfinite(commanded).all(axis=1)
    scans = trajectory.scans
    if scans is not None and chosen.start < chosen.stop:
        scans = replace(scans, stamps_ns=scans.stamps_ns[chosen], ranges=scans.ranges[chosen])
    else:
        scans = None
    return BagContent(
        poses=PoseStream(
            stamps_ns=stamps, poses=trajectory.poses[steps], twists=trajectory.measured[steps]
        ),
        commands=(
            CommandStream(stamps_ns=stamps[is_commanded], commands=commanded[is_commanded])
            if is_commanded.any()
            else None
        ),
        scans=scans,
        map_to_odom=inverse(scenario_frame(scenario)),
    )


def _recorded(place: Place | None) -> RecordedMap | None:
    if place is None:
        return None
    unoccupied = np.where(place.observed, np.uint8(_FREE), np.uint8(_UNKNOWN))
    return RecordedMap(
        cells=np.where(place.grid.cells, np.uint8(_OCCUPIED), unoccupied),
        resolution=place.grid.resolution,
        origin=Pose2D(*place.grid.origin),
    )


def _single(topic: str, message_type: str, stamp_ns: int, message: bytes) -> MessageStream:
    """Give a stream of one message."""
    return MessageStream(
        topic,
        message_type,
        np.array([stamp_ns], dtype=np.int64),
        np.frombuffer(message, dtype=f"V{len(message)}"),
    )


def _write_mcap(path: Path, streams: Sequence[MessageStream]) -> None:
    """Write a single MCAP file, its chunks compressed, whole or not at all."""
    with disk_errors(path):
        make_folder(path.parent)
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as scratch:
            # The file is named after its folder, and says its own name in its metadata.
            bag = Path(scratch) / path.stem
            write_ros2(bag, streams, "mcap", "storage")
            written = bag / f"{path.stem}.mcap"
            sync_file(written)
            written.replace(path)
        sync_folder(path.parent)
