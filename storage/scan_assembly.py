"""A bag's laser scans as one stream of one geometry, and where on the body the laser sits."""

from collections import Counter

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.extraction.recording import ScanStream
from ses_core.extraction.stream_cleaning import clean_clock, first_of_each_stamp, returns_only
from ses_core.extraction.transforms import PlanarMount, chain, planar_mount, transform_matrix
from ses_core.geometry import Pose2D
from ses_core.robot_profile import RobotProfile
from storage.collected_streams import BASE_FRAMES, CollectedStreams
from storage.message_decoding import FramedTransform, Scan

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
    geometries = Counter(_geometry(scan) for _, scan in streams.scans if _is_scan(scan))
    if not geometries:
        warnings["dropped_empty_scan"] += len(streams.scans)
        warnings["no_scans"] = 1
        return None
    empty = sum(not _is_scan(scan) for _, scan in streams.scans)
    warnings["dropped_empty_scan"] += empty
    geometry = geometries.most_common(1)[0][0]
    alike = [
        (stamp, scan)
        for stamp, scan in streams.scans
        if _is_scan(scan) and _geometry(scan) == geometry
    ]
    warnings["dropped_scan_geometry"] += len(streams.scans) - empty - len(alike)
    stamps = np.array([stamp for stamp, _ in alike], dtype=np.int64)
    order = np.arange(len(stamps))
    if len(stamps) > 1:
        clock = clean_clock(stamps, warnings)
        warnings["dropped_bad_stamp"] += clock.dropped
        order = clock.order
    fresh = first_of_each_stamp(stamps[order])
    warnings["dropped_repeated_stamp"] += int(np.count_nonzero(~fresh))
    order = order[fresh]
    first = alike[0][1]
    range_max = first.range_max
    if not (np.isfinite(range_max) and range_max > 0.0):
        range_max = profile.laser.range_max_m
    range_min = first.range_min if np.isfinite(first.range_min) else profile.laser.range_min_m
    ranges = np.empty((len(order), len(first.ranges)), dtype=np.float32)
    for row, index in enumerate(order):
        ranges[row] = alike[index][1].ranges
    mount = _mount(streams, profile, base, first.frame)
    sign = -1.0 if mount.is_upside_down else 1.0
    angles: FloatArray = sign * (
        first.angle_min + first.angle_increment * np.arange(len(first.ranges), dtype=np.float64)
    )
    return ScanStream(
        stamps_ns=stamps[order],
        ranges=returns_only(ranges, range_min=range_min, range_max=range_max),
        angles=angles,
        range_max=float(range_max),
        mount=mount.pose,
    )


def _is_scan(scan: Scan) -> bool:
    return (
        len(scan.ranges) > 1
        and bool(np.isfinite((scan.angle_min, scan.angle_increment)).all())
        and scan.angle_increment != 0.0
    )


def _geometry(scan: Scan) -> tuple[str, float, float, int]:
    return scan.frame, round(scan.angle_min, 4), round(scan.angle_increment, 7), len(scan.ranges)


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


def _constant(found: list[tuple[int, FramedTransform]], *, is_static: bool) -> FloatArray | None:
    """Give the matrix of transforms that never change; of static ones the last counts."""
    if is_static:
        return transform_matrix(found[-1][1].position, found[-1][1].orientation)
    numbers = np.array([(*item.position, *item.orientation) for _, item in found])
    if not np.isfinite(numbers).all() or np.ptp(numbers, axis=0).max() > _STATIC_TOLERANCE:
        return None
    return transform_matrix(found[0][1].position, found[0][1].orientation)
