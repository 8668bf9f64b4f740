"""A bag's laser scans as one stream of one geometry, and where on the body the laser sits."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ses_core.arrays import BoolArray, FloatArray
from ses_core.extraction.recording import ScanStream
from ses_core.extraction.stream_cleaning import clean_clock, first_of_each_stamp, returns_only
from ses_core.extraction.transforms import PlanarMount, chain, planar_mount, transform_matrix
from ses_core.geometry import Pose2D
from ses_core.robot_profile import RobotProfile
from storage.collected_streams import BASE_FRAMES, CollectedStreams, by_time
from storage.message_decoding import Scans, Transforms

_STATIC_TOLERANCE = 1e-4
"""A transform on /tf that never moves more than this [m, or part of a quaternion] is a mount."""


def assemble_scans(
    streams: CollectedStreams, profile: RobotProfile, base: str
) -> ScanStream | None:
    """Clean the scans of the commonest geometry and find their mount; None if there are none.

    Args:
        streams: Counters of what was dropped are added to its warnings.
        profile: Says what the log leaves out.
        base: Frame of the body.
    """
    warnings = streams.warnings
    total = sum(len(block.stamps_ns) for block in streams.scans)
    blocks = [_part(block, usable) for block in streams.scans if (usable := _is_scan(block)).any()]
    warnings["dropped_empty_scan"] += total - sum(len(block.stamps_ns) for block in blocks)
    if not blocks:
        warnings["no_scans"] = 1
        return None
    chosen = _commonest_geometry(blocks)
    alike = [_part(block, same) for block, same in zip(blocks, chosen, strict=True) if same.any()]
    warnings["dropped_scan_geometry"] += sum(int(np.count_nonzero(~same)) for same in chosen)
    stamps = np.concatenate([block.stamps_ns for block in alike])
    order = np.argsort(stamps, kind="stable")
    first = alike[0]
    if len(stamps):
        clock = clean_clock(stamps[order], warnings)
        warnings["dropped_bad_stamp"] += clock.dropped
        order = order[clock.order]
    fresh = first_of_each_stamp(stamps[order])
    warnings["dropped_repeated_stamp"] += int(np.count_nonzero(~fresh))
    order = order[fresh]
    angle_min, increment, range_min, range_max = first.geometry[0].astype(np.float64).tolist()
    if not (np.isfinite(range_max) and range_max > 0.0):
        range_max = profile.laser.range_max_m
    if not np.isfinite(range_min):
        range_min = profile.laser.range_min_m
    ranges = np.concatenate([block.ranges for block in alike])
    if not np.array_equal(order, np.arange(len(ranges))):
        ranges = ranges[order]
    mount = _mount(streams, profile, base, first.frame)
    sign = -1.0 if mount.is_upside_down else 1.0
    beams = np.arange(ranges.shape[1], dtype=np.float64)
    angles: FloatArray = sign * (angle_min + increment * beams)
    return ScanStream(
        stamps_ns=stamps[order],
        ranges=returns_only(ranges, range_min=range_min, range_max=range_max),
        angles=angles,
        range_max=float(range_max),
        mount=mount.pose,
    )


def _is_scan(block: Scans) -> BoolArray:
    """Tell which scans (K,) have more than one beam, in directions that make sense."""
    angle_min, increment = block.geometry[:, 0], block.geometry[:, 1]
    usable: BoolArray = np.isfinite(angle_min) & np.isfinite(increment) & (increment != 0.0)
    return usable & (block.ranges.shape[1] > 1)


def _part(block: Scans, chosen: BoolArray) -> Scans:
    if chosen.all():
        return block
    return Scans(block.frame, block.stamps_ns[chosen], block.geometry[chosen], block.ranges[chosen])


def _commonest_geometry(blocks: Sequence[Scans]) -> list[BoolArray]:
    """Tell for every scan of every block whether it has the geometry that most have."""
    rounded = [np.round(block.geometry[:, :2].astype(np.float64) * (1e4, 1e7)) for block in blocks]
    counts: Counter[tuple[str, int, float, float]] = Counter()
    for block, angles in zip(blocks, rounded, strict=True):
        found, numbers = np.unique(angles, axis=0, return_counts=True)
        for (angle_min, increment), number in zip(found.tolist(), numbers.tolist(), strict=True):
            counts[block.frame, block.ranges.shape[1], angle_min, increment] += number
    (frame, beams, *wanted), _ = counts.most_common(1)[0]
    return [
        (angles == np.array(wanted)).all(axis=1)
        & (block.frame == frame and block.ranges.shape[1] == beams)
        for block, angles in zip(blocks, rounded, strict=True)
    ]


def _mount(streams: CollectedStreams, profile: RobotProfile, base: str, laser: str) -> PlanarMount:
    """Find where the laser sits: from transforms that never change, else from the profile."""
    if not profile.scan_frame_is_mount:
        fixed = {}
        for edge, found in streams.transforms.items():
            matrix = _constant(found, is_static=edge in streams.static_edges)
            if matrix is not None:
                fixed[edge] = matrix
        for frame in dict.fromkeys((base, *BASE_FRAMES)):
            if laser == frame:
                return PlanarMount(pose=Pose2D(0.0, 0.0), is_upside_down=False)
            matrix = chain(fixed, frame, laser)
            if matrix is not None:
                return planar_mount(matrix)
        streams.warnings["mount_assumed"] = 1
    laser_profile = profile.laser
    pose = Pose2D(laser_profile.mount_x_m, laser_profile.mount_y_m, laser_profile.mount_yaw_rad)
    return PlanarMount(pose=pose, is_upside_down=False)


def _constant(found: Sequence[Transforms], *, is_static: bool) -> FloatArray | None:
    """Give the matrix of transforms that never change; of static ones the last counts."""
    _, (positions, turns) = by_time(
        [block.stamps_ns for block in found],
        [block.positions for block in found],
        [block.orientations for block in found],
    )
    if is_static:
        return transform_matrix(positions[-1].tolist(), turns[-1].tolist())
    numbers = np.column_stack((positions, turns))
    if not np.isfinite(numbers).all() or np.ptp(numbers, axis=0).max() > _STATIC_TOLERANCE:
        return None
    return transform_matrix(positions[0].tolist(), turns[0].tolist())
