"""`Recording`: what one log says, decoded and stripped of its format, before any clock is put on.

It is what crosses the wall between the limited decoder process and everything else: plain
arrays only, all stamps int64 nanoseconds UTC of *log time*, which orders messages and is sane
where header stamps are not.
"""

from dataclasses import dataclass, field

from ses_core.arrays import ByteArray, Float32Array, FloatArray, IntArray
from ses_core.geometry import Pose2D


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseStream:
    """Timed poses: stamps (K,) [ns], poses (K, 3) [m, m, rad], twists (K, 2) [m/s, rad/s], NaN."""

    stamps_ns: IntArray
    poses: FloatArray
    twists: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandStream:
    """Timed velocity commands: stamps (K,) [ns], commands (K, 2) [m/s, rad/s]."""

    stamps_ns: IntArray
    commands: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanStream:
    """Timed laser scans of one geometry.

    Attributes:
        stamps_ns: (S,) [ns].
        ranges: (S, B) [m]; inf where nothing came back, whatever the driver wrote for that.
        angles: (B,) [rad] in the laser's own frame.
        range_max: Farthest valid reading [m].
        mount: Pose of the laser on the body, from static transforms or the profile.
    """

    stamps_ns: IntArray
    ranges: Float32Array
    angles: FloatArray
    range_max: float
    mount: Pose2D


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedMap:
    """A `nav_msgs/OccupancyGrid`: cells (H, W) uint8: 0 free, 1 occupied, 2 unknown."""

    cells: ByteArray
    resolution: float
    origin: Pose2D


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """One decoded log.

    Attributes:
        has_clock: False where stamps cannot be used: one pose is then one step.
        pose_source: `odometry` or `map`.
        warnings: What was mended or passed over, with how often.
    """

    poses: PoseStream
    commands: CommandStream | None
    scans: ScanStream | None
    map: RecordedMap | None
    pose_source: str
    has_clock: bool
    messages_in: int
    messages_used: int
    warnings: dict[str, int] = field(default_factory=dict)
