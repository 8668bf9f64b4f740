"""Which of a log's topics are its scan, odometry, command, pose, map and transforms."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from rosbags.interfaces import Connection

from ses_core.errors import LogError
from ses_core.robot_profile import RobotProfile
from storage.message_decoding import OLD_TRANSFORMS
from storage.message_layouts import (
    LASER_SCAN,
    OCCUPANCY_GRID,
    ODOMETRY,
    POSE_STAMPED,
    POSE_WITH_COVARIANCE,
    TRANSFORMS,
    TWIST,
    TWIST_STAMPED,
)

_COMMAND_WORDS = ("cmd_vel", "cmd", "command")
_GOAL_WORDS = ("goal", "initialpose")


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicChoice:
    """The topics to read; None where the log has none of the kind."""

    scan: str | None
    odometry: str | None
    command: str | None
    pose: str | None
    map: str | None
    transforms: frozenset[str]
    static_transforms: frozenset[str]

    def topics(self) -> frozenset[str]:
        """Give all of them."""
        named = (self.scan, self.odometry, self.command, self.pose, self.map)
        chosen = {topic for topic in named if topic is not None}
        return frozenset(chosen | self.transforms | self.static_transforms)


def choose_topics(
    connections: Sequence[Connection], profile: RobotProfile, *, pose_source: str
) -> TopicChoice:
    """Choose topics by message type, then by the profile, then by name and number of messages.

    Raises:
        LogError: `missing_topic`: a topic that the profile names is not in the log.
    """
    transforms = frozenset(
        connection.topic
        for connection in connections
        if connection.msgtype in (TRANSFORMS, OLD_TRANSFORMS)
    )
    static = frozenset(topic for topic in transforms if topic.rpartition("/")[2] == "tf_static")
    return TopicChoice(
        scan=_choose(connections, (LASER_SCAN,), profile.scan_topic, _named("scan")),
        odometry=_choose(connections, (ODOMETRY,), profile.odometry_topic, _named("odom")),
        command=_choose(connections, (TWIST, TWIST_STAMPED), profile.command_topic, _command_rank),
        pose=_choose(
            connections,
            (POSE_WITH_COVARIANCE, POSE_STAMPED),
            profile.pose_topic,
            _pose_rank,
        )
        if pose_source == "map"
        else None,
        map=_choose(connections, (OCCUPANCY_GRID,), profile.map_topic, _map_rank),
        transforms=transforms - static,
        static_transforms=static,
    )


def _choose(
    connections: Iterable[Connection],
    types: tuple[str, ...],
    fixed: str | None,
    rank: Callable[[str], int | None],
) -> str | None:
    """Give the topic of the lowest rank, then of the most messages, then first by name."""
    counts: dict[str, int] = {}
    for connection in connections:
        if connection.msgtype in types and connection.msgcount:
            counts[connection.topic] = counts.get(connection.topic, 0) + connection.msgcount
    if fixed is not None:
        if fixed not in counts:
            raise LogError(
                "missing_topic",
                f"topic {fixed!r} of the profile is not among {sorted(counts)[:10]} ({types[0]})",
            )
        return fixed
    ranked = [
        (order, -count, topic)
        for topic, count in counts.items()
        if (order := rank(topic)) is not None
    ]
    return min(ranked)[2] if ranked else None


def _named(name: str) -> Callable[[str], int | None]:
    def rank(topic: str) -> int:
        return 0 if topic.rpartition("/")[2] == name else 1

    return rank


def _command_rank(topic: str) -> int | None:
    """Rank by name; a `Twist` on a topic named after nothing like a command is a measurement."""
    last = topic.rpartition("/")[2]
    if last == "cmd_vel":
        return 0
    for order, word in enumerate(_COMMAND_WORDS, start=1):
        if word in last:
            return order
    return None


def _pose_rank(topic: str) -> int | None:
    last = topic.rpartition("/")[2]
    if any(word in last for word in _GOAL_WORDS):
        return None
    return 0 if last == "amcl_pose" else 1


def _map_rank(topic: str) -> int | None:
    last = topic.rpartition("/")[2]
    if "costmap" in topic:
        return None
    return 0 if last == "map" else 1
