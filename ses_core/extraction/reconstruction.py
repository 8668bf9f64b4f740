"""Scenario -> the 5 m x 5 m place it happened in, from the scans or from a map (section III-B).

Both ways first fill a fine grid, four cells to the side of an environment cell (4.2 cm), in
the frame of the scenario. An environment cell is occupied if any fine cell in it is: walls
thinner than a cell must not leak.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import ndimage

from ses_core.arrays import BoolArray, ByteArray, FloatArray
from ses_core.extraction.ray_tracing import Evidence, trace_scans
from ses_core.extraction.recording import RecordedMap, ScanStream
from ses_core.extraction.scenario import Scenario
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import Pose2D, compose_all, from_frame, to_frame, wrap_angles
from ses_core.occupancy import (
    ENVIRONMENT_CELLS,
    ENVIRONMENT_RESOLUTION_M,
    ENVIRONMENT_SIDE_M,
    OccupancyGrid,
    cell_indices,
    environment_course,
    grid_to_environment,
    occupied_at,
)
from ses_core.settings import ExtractionSettings

FINE = 4
"""Fine cells along the side of an environment cell."""

FINE_CELLS = ENVIRONMENT_CELLS * FINE
FINE_RESOLUTION_M = ENVIRONMENT_RESOLUTION_M / FINE

SEEN_SHARE = 0.25
"""An environment cell was observed if this share of it was: one beam straight through it."""

SWEPT_RADIUS_LIMIT_M = ENVIRONMENT_RESOLUTION_M
"""The swept disc is never larger [m], lest a profile too large for its robot erase walls."""

PATH_SPACING_M = FINE_RESOLUTION_M / 2
"""Distance [m] between the points at which a path is looked at, however slowly it was driven."""

FREE, OCCUPIED, UNKNOWN = 0, 1, 2
"""Values of fine cells, as in a `RecordedMap`."""

_ORIGIN = (0.0, -ENVIRONMENT_SIDE_M / 2.0)
"""Lower left corner of the window in the frame of its scenario [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reconstruction:
    """What was rebuilt of a scenario's place.

    Attributes:
        cells: (30, 30) environment cells, True = occupied.
        observed: (30, 30) True = seen by a beam, or known from the map.
        origin: `scan` or `map`.
        path_in_free_fraction: Share of the driven path that lies in free cells of the course,
            before the path corrected any; what leaves the window sideways is not free.
        overridden_cells: Occupied cells that were freed because the robot itself drove there.
        contradicted_fraction: Share of the beam ends in the window that lie in cells which most
            beams looked through. Some are people; where most are, the poses were wrong and
            the place is smeared until nothing is left. None from a map.
    """

    cells: BoolArray
    observed: BoolArray
    origin: Literal["scan", "map"]
    path_in_free_fraction: float
    overridden_cells: int
    contradicted_fraction: float | None


def scenario_frame(scenario: Scenario) -> Pose2D:
    """Give the frame of a scenario: origin at the start, x towards the goal, y to the left."""
    dx, dy = scenario.goal[0] - scenario.start.x, scenario.goal[1] - scenario.start.y
    return Pose2D(scenario.start.x, scenario.start.y, math.atan2(dy, dx))


def reconstruct(
    trajectory: Trajectory,
    scenario: Scenario,
    *,
    recorded_map: RecordedMap | None,
    settings: ExtractionSettings,
    body_radius: float,
) -> Reconstruction | None:
    """Rebuild the place of a scenario; None where neither scans nor a map show any of it.

    Args:
        trajectory: The one that the scenario was cut from.
        scenario: Which part of it.
        recorded_map: A map in the frame of the trajectory's poses, if there is one.
        settings: `source` chooses between scans and map, `unknown` what unseen cells become.
        body_radius: Radius [m] of the disc inside the body of the robot that drove.
    """
    frame = scenario_frame(scenario)
    origin: Literal["scan", "map"] = "map"
    contradicted: float | None = None
    if recorded_map is not None and settings.source != "scan":
        fine = _from_map(recorded_map, frame)
    elif settings.source != "map":
        origin = "scan"
        evidence = _scan_evidence(trajectory, scenario, frame, settings)
        if evidence is None:
            return None
        fine = _weigh(evidence, settings)
        contradicted = _contradicted_fraction(evidence, settings)
    else:
        return None
    if (fine == UNKNOWN).all():
        return None
    path = driven_path(trajectory, scenario)
    as_seen, _ = _resolve(fine, settings)
    swept = _swept_by_disc(path, min(body_radius, SWEPT_RADIUS_LIMIT_M))
    cells, observed = _resolve(np.where(swept, np.uint8(FREE), fine), settings)
    return Reconstruction(
        cells=cells,
        observed=observed,
        origin=origin,
        path_in_free_fraction=float((~occupied_at(environment_course(as_seen), path)).mean()),
        overridden_cells=int((as_seen & ~cells).sum()),
        contradicted_fraction=contradicted,
    )


def driven_path(trajectory: Trajectory, scenario: Scenario) -> FloatArray:
    """Give points (P, 2) [m] of the way driven, evenly spaced, in the frame of the scenario."""
    first = scenario.first_step - trajectory.first_step
    last = scenario.last_step - trajectory.first_step
    points = to_frame(trajectory.poses[first : last + 1, :2], scenario_frame(scenario))
    steps = np.diff(points, axis=0)
    along = np.concatenate(([0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))))
    even = np.linspace(0.0, along[-1], max(2, math.ceil(along[-1] / PATH_SPACING_M)))
    return np.column_stack(
        (np.interp(even, along, points[:, 0]), np.interp(even, along, points[:, 1]))
    )


def scans_of(trajectory: Trajectory, scenario: Scenario, *, margin: float) -> slice:
    """Find the scans taken during a scenario and up to a margin [s] before and after it."""
    if trajectory.scans is None:
        return slice(0, 0)
    last = scenario.last_step - trajectory.first_step
    margin_ns = round(margin * 1e9)
    stamps = trajectory.scans.stamps_ns
    begin = np.searchsorted(stamps, scenario.start_stamp_ns - margin_ns, "left")
    end = np.searchsorted(stamps, trajectory.stamps_ns[last] + margin_ns, "right")
    return slice(int(begin), int(end))


def sensor_poses(scans: ScanStream, body_poses: FloatArray, frame: Pose2D) -> FloatArray:
    """Place the laser of every scan, (S, 3) [m, m, rad], in a frame, from poses of the body."""
    poses = compose_all(body_poses, scans.mount)
    return np.column_stack((to_frame(poses[:, :2], frame), wrap_angles(poses[:, 2] - frame.yaw)))


def _scan_evidence(
    trajectory: Trajectory, scenario: Scenario, frame: Pose2D, settings: ExtractionSettings
) -> Evidence | None:
    """Trace the scans of a scenario through the fine grid; None where there are none."""
    chosen = scans_of(trajectory, scenario, margin=settings.scan_margin_s)
    if trajectory.scans is None or trajectory.scan_poses is None or chosen.start == chosen.stop:
        return None
    return trace_scans(
        trajectory.scans.ranges[chosen],
        trajectory.scans.angles,
        sensor_poses(trajectory.scans, trajectory.scan_poses[chosen], frame),
        range_max=trajectory.scans.range_max,
        origin=_ORIGIN,
        resolution=FINE_RESOLUTION_M,
        size=FINE_CELLS,
    )


def _weigh(evidence: Evidence, settings: ExtractionSettings) -> ByteArray:
    """Decide every fine cell [iy, ix] from its hits and passes.

    One hit is enough where no beam ever looked through: far walls of a log with few scans.
    """
    seen = evidence.hits + evidence.passes
    fine = np.where(seen > 0, np.uint8(FREE), np.uint8(UNKNOWN))
    is_sure = (evidence.hits >= settings.hit_minimum) | (evidence.passes == 0)
    is_hit = (evidence.hits > 0) & (evidence.hits >= settings.hit_share * seen)
    fine[is_sure & is_hit] = OCCUPIED
    return fine


def _contradicted_fraction(evidence: Evidence, settings: ExtractionSettings) -> float:
    seen = evidence.hits + evidence.passes
    contradicted = evidence.hits[evidence.hits < settings.hit_share * seen].sum()
    return float(contradicted / max(1, evidence.hits.sum()))


def _from_map(recorded_map: RecordedMap, frame: Pose2D) -> ByteArray:
    """Fill the fine grid [iy, ix] from a map, with two samples or more to each of its cells."""
    samples = min(max(math.ceil(2.0 * FINE_RESOLUTION_M / recorded_map.resolution), 2), 8)
    count = FINE_CELLS * samples
    offsets = (np.arange(count) + 0.5) * (FINE_RESOLUTION_M / samples)
    x, y = np.meshgrid(offsets + _ORIGIN[0], offsets + _ORIGIN[1])
    in_world = from_frame(np.column_stack((x.ravel(), y.ravel())), frame)
    # The map is an OccupancyGrid in its own frame, which its origin may turn.
    grid = OccupancyGrid(cells=recorded_map.cells != FREE, resolution=recorded_map.resolution)
    indices = cell_indices(grid, to_frame(in_world, recorded_map.origin))
    height, width = recorded_map.cells.shape
    inside = ((indices >= 0) & (indices < (width, height))).all(axis=1)
    values = np.full(count * count, UNKNOWN, dtype=np.uint8)
    values[inside] = recorded_map.cells[indices[inside, 1], indices[inside, 0]]
    blocks = values.reshape(FINE_CELLS, samples, FINE_CELLS, samples)
    fine = np.full((FINE_CELLS, FINE_CELLS), UNKNOWN, dtype=np.uint8)
    fine[(blocks != UNKNOWN).mean(axis=(1, 3)) >= 0.5] = FREE
    fine[(blocks == OCCUPIED).any(axis=(1, 3))] = OCCUPIED
    return fine


def _resolve(fine: ByteArray, settings: ExtractionSettings) -> tuple[BoolArray, BoolArray]:
    """Turn the fine grid into environment cells and their observed mask."""
    blocks = fine.reshape(ENVIRONMENT_CELLS, FINE, ENVIRONMENT_CELLS, FINE)
    occupied = (blocks == OCCUPIED).any(axis=(1, 3))
    observed = occupied | ((blocks != UNKNOWN).mean(axis=(1, 3)) >= SEEN_SHARE)
    if settings.unknown == "occupied":
        occupied = occupied | ~observed
    return _as_environment(occupied), _as_environment(observed)


def _as_environment(cells: BoolArray) -> BoolArray:
    return grid_to_environment(
        OccupancyGrid(cells=cells, resolution=ENVIRONMENT_RESOLUTION_M, origin=_ORIGIN)
    )


def _swept_by_disc(path: FloatArray, radius: float) -> BoolArray:
    """Mark the fine cells [iy, ix] whose centre a disc covered on its way."""
    driven = np.zeros((FINE_CELLS, FINE_CELLS), dtype=np.bool_)
    indices = np.floor((path - _ORIGIN) / FINE_RESOLUTION_M).astype(np.int64)
    inside = indices[((indices >= 0) & (indices < FINE_CELLS)).all(axis=1)]
    driven[inside[:, 1], inside[:, 0]] = True
    if len(inside) == 0:
        return driven
    distance = ndimage.distance_transform_edt(~driven, sampling=FINE_RESOLUTION_M)
    swept: BoolArray = distance <= radius
    return swept
