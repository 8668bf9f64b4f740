"""From a bag's decoded messages to a clean `Recording`: poses, velocities, scans, mount and map."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ses_core.arrays import BoolArray, ByteArray, FloatArray, IntArray
from ses_core.errors import LogError
from ses_core.extraction.recording import CommandStream, PoseStream, RecordedMap, Recording
from ses_core.extraction.stream_cleaning import (
    clean_clock,
    first_of_each_stamp,
    plausible_twists,
    usable_poses,
)
from ses_core.geometry import Pose2D, compose_rows
from ses_core.robot_profile import RobotProfile
from storage.collected_streams import BASE_FRAMES, CollectedStreams, by_time
from storage.message_decoding import Transforms
from storage.scan_assembly import assemble_scans

_UNIT_TOLERANCE = 1e-2
_SHORTEST_QUATERNION = 0.1
_OCCUPIED_PERCENT = 50
_FREE, _OCCUPIED, _UNKNOWN = 0, 1, 2
_SAME_FRAME = 1e-3
"""Two frames are one if neither is moved by more than this [m, rad]."""


def assemble_recording(
    streams: CollectedStreams, *, profile: RobotProfile, pose_source: str
) -> Recording:
    """Clean the streams and put them together.

    Raises:
        LogError: There are no usable poses, or no usable clock.
    """
    warnings = streams.warnings
    base = _base_frame(streams, profile)
    odometry = _odometry(streams, profile, base)
    poses, used_source = odometry, "odometry"
    if pose_source == "map":
        in_map = _poses_in_map(streams, odometry, base)
        if in_map is None:
            warnings["no_map_pose"] = 1
        else:
            poses, used_source = in_map, "map"
    commands = _commands(streams, profile)
    scans = assemble_scans(streams, profile, base)
    recorded_map = _map_of_poses(streams, used_source)
    dropped = sum(count for name, count in warnings.items() if name.startswith("dropped_"))
    return Recording(
        poses=poses,
        commands=commands,
        scans=scans,
        map=recorded_map,
        pose_source=used_source,
        has_clock=True,
        messages_in=streams.messages_in,
        messages_used=streams.messages_in - dropped,
        warnings={name: count for name, count in sorted(warnings.items()) if count},
    )


def _base_frame(streams: CollectedStreams, profile: RobotProfile) -> str:
    if profile.base_frame is not None:
        return profile.base_frame
    named: Counter[str] = Counter()
    for odometry in streams.odometry:
        named[odometry.child] += len(odometry.stamps_ns) if odometry.child else 0
    if named.total():
        return named.most_common(1)[0][0]
    frames = {frame for edge in streams.transforms for frame in edge}
    return next((frame for frame in BASE_FRAMES if frame in frames), BASE_FRAMES[0])


def _odometry(streams: CollectedStreams, profile: RobotProfile, base: str) -> PoseStream:
    if streams.odometry:
        stamps, (positions, turns, twists) = by_time(
            [block.stamps_ns for block in streams.odometry],
            [block.positions for block in streams.odometry],
            [block.orientations for block in streams.odometry],
            [block.twists for block in streams.odometry],
        )
        return _pose_stream(streams.warnings, profile, stamps, positions, turns, twists)
    edge = next(
        (
            edge
            for edge in streams.transforms
            if edge[0].rpartition("/")[2] == "odom" and edge[1] in (base, *BASE_FRAMES)
        ),
        None,
    )
    if edge is None:
        raise LogError("missing_topic", "log has no odometry, and no transform from odom to base")
    streams.warnings["pose_from_transforms"] = 1
    stamps, (positions, turns) = _transform_columns(streams.transforms[edge])
    twists = np.full((len(stamps), 2), np.nan)
    # Transforms are counted as messages already: what is dropped here is only a pose.
    return _pose_stream(Counter(), profile, stamps, positions, turns, twists)


def _pose_stream(
    warnings: Counter[str],
    profile: RobotProfile,
    stamps: IntArray,
    positions: FloatArray,
    quaternions: FloatArray,
    twists: FloatArray,
) -> PoseStream:
    """Clean timed poses.

    Raises:
        LogError: `bad_values`: most poses are unusable; `bad_clock`.
    """
    clock = clean_clock(stamps, warnings)
    warnings["dropped_bad_stamp"] += clock.dropped
    stamps, positions = stamps[clock.order], positions[clock.order]
    quaternions, twists = quaternions[clock.order], twists[clock.order]
    yaws, off_unit = _yaws(quaternions)
    poses = np.column_stack((positions[:, :2], yaws))
    usable = usable_poses(poses)
    if 2 * np.count_nonzero(usable) <= len(usable):
        raise LogError(
            "bad_values",
            f"{np.count_nonzero(~usable)} of {len(usable)} poses are not finite or out of reach",
        )
    warnings["dropped_bad_pose"] += int(np.count_nonzero(~usable))
    warnings["quaternion_normalized"] += int(np.count_nonzero(off_unit & usable))
    stamps, poses, twists = stamps[usable], poses[usable], twists[usable]
    fresh = first_of_each_stamp(stamps)
    warnings["dropped_repeated_stamp"] += int(np.count_nonzero(~fresh))
    known = ~np.isnan(twists).all(axis=1)
    clean, absurd = plausible_twists(twists, profile)
    warnings["absurd_velocity"] += absurd if known.any() else 0
    return PoseStream(stamps_ns=stamps[fresh], poses=poses[fresh], twists=clean[fresh])


def _yaws(
    quaternions: FloatArray,
) -> tuple[FloatArray, BoolArray]:
    """Give headings (K,) [rad], NaN where a quaternion is none, and which were not of length 1."""
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        norms = np.sqrt(np.sum(quaternions**2, axis=1))
        x, y, z, w = (quaternions / norms[:, None]).T
        yaws = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        usable = np.isfinite(norms) & (norms > _SHORTEST_QUATERNION)
        off_unit = np.abs(norms - 1.0) > _UNIT_TOLERANCE
    return np.where(usable, yaws, np.nan), off_unit


def _poses_in_map(streams: CollectedStreams, odometry: PoseStream, base: str) -> PoseStream | None:
    """Give poses in the map's frame, from transforms or a pose topic; None if absent."""
    if found := _map_to_odometry(streams):
        stamps, corrections = _planar(found)
        if len(stamps) == 0:
            return None
        # A correction holds until the next; before the first one, the first.
        latest = np.searchsorted(stamps, odometry.stamps_ns, side="right") - 1
        poses = compose_rows(corrections[np.maximum(latest, 0)], odometry.poses)
        return PoseStream(stamps_ns=odometry.stamps_ns, poses=poses, twists=odometry.twists)
    direct = next(
        (
            found
            for (parent, child), found in streams.transforms.items()
            if parent.rpartition("/")[2] == "map" and child in (base, *BASE_FRAMES)
        ),
        streams.poses,
    )
    stamps, poses = _planar(direct)
    if len(stamps) < 2:
        return None
    twists = np.full((len(stamps), 2), np.nan)
    inside = np.searchsorted(odometry.stamps_ns, stamps).clip(0, len(odometry.stamps_ns) - 1)
    twists[:] = odometry.twists[inside]
    return PoseStream(stamps_ns=stamps, poses=poses, twists=twists)


def _transform_columns(blocks: Sequence[Transforms]) -> tuple[IntArray, list[FloatArray]]:
    """Give stamps, positions and quaternions of transforms in order of time."""
    return by_time(
        [block.stamps_ns for block in blocks],
        [block.positions for block in blocks],
        [block.orientations for block in blocks],
    )


def _planar(blocks: Sequence[Transforms]) -> tuple[IntArray, FloatArray]:
    """Give the usable stamps (K,) [ns] and poses (K, 3) of transforms, in order, none repeated."""
    if not blocks:
        return np.empty(0, dtype=np.int64), np.empty((0, 3))
    stamps, (positions, turns) = _transform_columns(blocks)
    yaws, _ = _yaws(turns)
    poses = np.column_stack((positions[:, :2], yaws))
    usable = usable_poses(poses)
    stamps, poses = stamps[usable], poses[usable]
    fresh = first_of_each_stamp(stamps)
    return stamps[fresh], poses[fresh]


def _commands(streams: CollectedStreams, profile: RobotProfile) -> CommandStream | None:
    if not streams.commands:
        return None
    warnings = streams.warnings
    stamps, (commands,) = by_time(
        [block.stamps_ns for block in streams.commands],
        [block.twists for block in streams.commands],
    )
    if len(stamps):
        clock = clean_clock(stamps, warnings)
        warnings["dropped_bad_stamp"] += clock.dropped
        stamps, commands = stamps[clock.order], commands[clock.order]
    clean, absurd = plausible_twists(commands, profile)
    warnings["absurd_command"] += absurd
    # Of commands with one stamp the last one counts: the base obeys whoever spoke last.
    last = np.append(np.diff(stamps) > 0, True)
    warnings["dropped_repeated_stamp"] += int(np.count_nonzero(~last))
    return CommandStream(stamps_ns=stamps[last], commands=clean[last])


def _map_of_poses(streams: CollectedStreams, pose_source: str) -> RecordedMap | None:
    """Give the map if it is in the frame of the poses."""
    if pose_source == "odometry" and streams.map and _odometry_moves_in_map(streams):
        streams.warnings["map_of_other_frame"] = 1
        return None
    return assemble_map(streams)


def assemble_map(streams: CollectedStreams) -> RecordedMap | None:
    """Give the map among the streams; None where there is none that can be used."""
    grid = streams.map
    if grid is None:
        return None
    yaw = _yaw(grid.orientation)
    usable = np.isfinite((grid.resolution, *grid.position[:2], yaw)).all()
    if not usable or grid.resolution <= 0.0 or grid.data.size == 0:
        streams.warnings["dropped_bad_map"] += 1
        return None
    cells: ByteArray = np.full(grid.data.shape, _FREE, dtype=np.uint8)
    cells[grid.data >= _OCCUPIED_PERCENT] = _OCCUPIED
    cells[grid.data < 0] = _UNKNOWN
    origin = Pose2D(float(grid.position[0]), float(grid.position[1]), yaw)
    return RecordedMap(cells=cells, resolution=grid.resolution, origin=origin)


def _odometry_moves_in_map(streams: CollectedStreams) -> bool:
    """Tell whether transforms say that the frame of the odometry is not that of the map."""
    found = _map_to_odometry(streams)
    if not found:
        return False
    _, corrections = _planar(found)
    return bool(np.any(np.abs(corrections) > _SAME_FRAME))


def _map_to_odometry(streams: CollectedStreams) -> Sequence[Transforms]:
    """Give the transforms from the map to the odometry; none where the log has none."""
    return next(
        (
            found
            for (parent, child), found in streams.transforms.items()
            if parent.rpartition("/")[2] == "map" and child.rpartition("/")[2] == "odom"
        ),
        (),
    )


def _yaw(orientation: FloatArray) -> float:
    """Give a heading [rad]; map servers often leave the quaternion at zero, which means none."""
    if not orientation.any():
        return 0.0
    yaws, _ = _yaws(orientation[None])
    return float(yaws[0])
