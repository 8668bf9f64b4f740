"""Our decoder against `rosbags`' own, on the same bags of a simulated fleet, in the same process.

Both sides open the bag and decode its scans, odometry and twists; ours is what the decoder's
child process runs, up to the streams it makes a recording of. The child's start-up stands apart.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.highlevel import AnyReader

from ses_core.fleet_settings import FleetSettings
from ses_core.learning.policies import FIXED_POLICIES
from ses_core.robot_profile import GENERIC, JACKAL
from ses_core.settings import DecoderLimits, Settings, SimulationSettings
from ses_core.worlds.deployment import Deployment, deploy
from ses_core.worlds.homes import generate_homes
from ses_core.worlds.pairs import MIN_DISTANCE_M
from storage.collected_streams import CollectedStreams
from storage.deployment_logs import FleetFormat, write_deployments
from storage.log_decoder import decode_log
from storage.log_formats import ROSBAG1, ROSBAG2_MCAP, ROSBAG2_SQLITE, make_reader
from storage.rosbag_containers import open_recording
from storage.rosbag_logs import collect_streams
from storage.topic_choice import choose_topics
from tasks.deploy import fleet_tasks

FORMATS: dict[FleetFormat, str] = {
    "mcap": ROSBAG2_MCAP,
    "bag": ROSBAG1,
    "db3": ROSBAG2_SQLITE,
}
TOPICS = ("/scan", "/odom", "/cmd_vel")
ROUNDS = 5
MESSAGES = 100_000
DEPLOYMENTS = 40
LIMITS = DecoderLimits()

Columns = dict[str, NDArray[Any]]


def measure(
    scratch: Path,
    *,
    deployments: int = DEPLOYMENTS,
    least: int = MESSAGES,
    rounds: int = ROUNDS,
    formats: Sequence[FleetFormat] = tuple(FORMATS),
) -> list[dict[str, str | float]]:
    """Decode one robot's day in every format, both ways by turns; rates are of the best rounds."""
    day = _drive_day(deployments)
    rows = []
    for name in formats:
        bag = _write_day(scratch / f"day-{name}", day, name)
        folder = scratch / f"inflated-{name}"
        folder.mkdir()
        count = _require_equal(bag, folder)
        if count < least:
            raise ValueError(f"bag has {count} messages, expected at least {least}")
        our_seconds, their_seconds = _by_turns(
            (partial(_decode_ours, bag, folder), partial(_decode_and_forget, bag)), rounds
        )
        rows.append(
            _row(f"decoding {name}, {count} messages", count / our_seconds, count / their_seconds)
        )
        rows.append(_start_up(bag, FORMATS[name], scratch, folder, rounds))
    return rows


def _drive_day(deployments: int) -> list[Deployment]:
    """Let one robot drive all day."""
    tasks = fleet_tasks(
        generate_homes(1, seed=3),
        deployments,
        min_distance=MIN_DISTANCE_M,
        preset="long",
        profile=JACKAL,
        seed=0,
    )
    driven = deploy(
        tasks,
        FIXED_POLICIES["dwa-slow"],
        seed=0,
        simulation=SimulationSettings(),
        profile=JACKAL,
    )
    return list(driven)


def _write_day(out: Path, day: Sequence[Deployment], name: FleetFormat) -> Path:
    """Write all of a day into one log."""
    fleet = FleetSettings(robots_per_site=1, drives_per_log=len(day))
    tasks = [deployment.task for deployment in sorted(day, key=lambda each: each.number)]
    write_deployments(
        out,
        iter(day),
        tasks=tasks,
        format=name,
        day=date(2026, 1, 2),
        settings=Settings(fleet=fleet),
    )
    (done,) = out.rglob("*.done")
    return done.with_suffix("")


def _decode_ours(bag: Path, folder: Path) -> CollectedStreams:
    with open_recording(bag, limits=LIMITS, workdir=folder) as recording:
        wanted = [one for one in recording.connections if one.topic in TOPICS]
        choice = choose_topics(wanted, GENERIC, pose_source="odometry")
        return collect_streams(recording, choice, output_limit=LIMITS.output_mib * 2**20)


def _decode_theirs(bag: Path) -> Iterator[tuple[str, int, Any]]:
    with AnyReader([bag]) as reader:
        wanted = [one for one in reader.connections if one.topic in TOPICS]
        for connection, stamp, content in reader.messages(connections=wanted):
            yield connection.topic, stamp, reader.deserialize(content, connection.msgtype)


def _decode_and_forget(bag: Path) -> None:
    """Decode their way at its best: no message is kept, no number put into a column."""
    for _ in _decode_theirs(bag):
        pass


def _by_turns(sides: Sequence[Callable[[], object]], rounds: int) -> list[float]:
    """Give each side's best time [s] of several rounds, one after the other in each."""
    seconds: list[list[float]] = [[] for _ in sides]
    for _ in range(rounds):
        for side, taken in zip(sides, seconds, strict=True):
            started = time.perf_counter()
            side()
            taken.append(time.perf_counter() - started)
    return [min(taken) for taken in seconds]


def _require_equal(bag: Path, folder: Path) -> int:
    """Compare every number that both sides give; give how many messages they decoded."""
    ours = _decode_ours(bag, folder)
    theirs: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in TOPICS}
    for topic, stamp, message in _decode_theirs(bag):
        theirs[topic].append((stamp, message))
    ours_columns = _our_columns(ours)
    for name, column in _their_columns(theirs).items():
        if not np.array_equal(column, ours_columns[name], equal_nan=True):
            raise ValueError(f"{name} differs between the decoders")
    if ours.messages_in != sum(map(len, theirs.values())):
        raise ValueError("the decoders give different numbers of messages")
    return ours.messages_in


def _our_columns(streams: CollectedStreams) -> Columns:
    scans, odometry, commands = streams.scans, streams.odometry, streams.commands
    return {
        "scan stamps": np.concatenate([block.stamps_ns for block in scans]),
        "scan geometry": np.concatenate([block.geometry for block in scans]),
        "ranges": np.concatenate([block.ranges for block in scans]),
        "odometry stamps": np.concatenate([block.stamps_ns for block in odometry]),
        "positions": np.concatenate([block.positions for block in odometry]),
        "orientations": np.concatenate([block.orientations for block in odometry]),
        "measured": np.concatenate([block.twists for block in odometry]),
        "command stamps": np.concatenate([block.stamps_ns for block in commands]),
        "commands": np.concatenate([block.twists for block in commands]),
    }


def _their_columns(decoded: dict[str, list[tuple[int, Any]]]) -> Columns:
    scans = [message for _, message in decoded["/scan"]]
    poses = [message.pose.pose for _, message in decoded["/odom"]]
    twists = [message.twist.twist for _, message in decoded["/odom"]]
    commands = [message for _, message in decoded["/cmd_vel"]]
    return {
        "scan stamps": np.array([stamp for stamp, _ in decoded["/scan"]]),
        "scan geometry": np.array(
            [(s.angle_min, s.angle_increment, s.range_min, s.range_max) for s in scans],
            dtype=np.float32,
        ),
        "ranges": np.array([scan.ranges for scan in scans]),
        "odometry stamps": np.array([stamp for stamp, _ in decoded["/odom"]]),
        "positions": np.array([(p.position.x, p.position.y, p.position.z) for p in poses]),
        "orientations": np.array(
            [(p.orientation.x, p.orientation.y, p.orientation.z, p.orientation.w) for p in poses]
        ),
        "measured": np.array([(twist.linear.x, twist.angular.z) for twist in twists]),
        "command stamps": np.array([stamp for stamp, _ in decoded["/cmd_vel"]]),
        "commands": np.array([(command.linear.x, command.angular.z) for command in commands]),
    }


def _start_up(
    bag: Path, log_format: str, scratch: Path, folder: Path, rounds: int
) -> dict[str, str | float]:
    """What the child process adds: its start, and handing the recording over.

    Against the whole of reading in this process, transforms and cleaning included.
    """
    reader = make_reader(log_format, limits=LIMITS, workdir=folder)

    def here() -> None:
        reader.read(bag, profile=GENERIC, pose_source="odometry")

    def in_child() -> None:
        decode_log(
            bag,
            format=log_format,
            profile=GENERIC,
            pose_source="odometry",
            limits=LIMITS,
            workdir=scratch,
        )

    child, own = _by_turns((in_child, here), rounds)
    return {
        "name": f"child process for {log_format}: start-up and hand-over beside reading itself",
        "unit": "s",
        "ours": round(child - own, 3),
        "theirs": round(own, 3),
        "ratio": round((child - own) / own, 3),
    }


def _row(name: str, ours: float, theirs: float) -> dict[str, str | float]:
    return {
        "name": name,
        "unit": "messages/s",
        "ours": round(ours),
        "theirs": round(theirs),
        "ratio": round(ours / theirs, 2),
    }
