"""Evidence from laser scans: how often each cell of a grid was hit and how often looked through."""

import math
from dataclasses import dataclass

import numpy as np

from ses_core.arrays import Float32Array, FloatArray, IntArray
from ses_core.compilation import compiled


@dataclass(frozen=True, slots=True)
class Evidence:
    """Per cell [iy, ix] of a square grid, the number of scans that ...

    Attributes:
        hits: (n, n) ended a beam in it.
        passes: (n, n) looked through it and ended none in it.
    """

    hits: IntArray
    passes: IntArray


def trace_scans(
    ranges: Float32Array,
    angles: FloatArray,
    sensor_poses: FloatArray,
    *,
    range_max: float,
    origin: tuple[float, float],
    resolution: float,
    size: int,
) -> Evidence:
    """Trace every beam of every scan through a square grid.

    Within one scan a cell counts once, and a hit wins over a pass: beams that graze a wall
    run through its cells on their way to the next one and would otherwise wear it away.

    A beam without a return (inf) proves little, since dark, shiny or slanted walls return
    nothing (a Neato loses 60-84 % of its readings). It shows cells free only as far as the
    nearer of the two returns beside it in its scan, and as far as `range_max` where the whole
    scan returned nothing.

    Args:
        ranges: (S, B) [m]; anything but a finite value in (0, range_max] is no return.
        angles: (B,) [rad] in the frame of the sensor.
        sensor_poses: (S, 3) [m, m, rad] in the frame of the grid.
        range_max: Farthest valid reading [m].
        origin: Lower left corner of the grid [m].
        resolution: Cell size [m].
        size: Cells along each side.
    """
    hits = np.zeros((size, size), dtype=np.int64)
    passes = np.zeros((size, size), dtype=np.int64)
    in_cells = np.asarray(sensor_poses, dtype=np.float64).copy()
    in_cells[:, :2] = (in_cells[:, :2] - origin) / resolution
    _trace(
        np.asarray(ranges, dtype=np.float32),
        np.asarray(angles, dtype=np.float64),
        in_cells,
        range_max,
        resolution,
        hits,
        passes,
    )
    return Evidence(hits, passes)


@compiled
def _trace(
    ranges: Float32Array,
    angles: FloatArray,
    poses: FloatArray,
    range_max: float,
    resolution: float,
    hits: IntArray,
    passes: IntArray,
) -> None:
    """Add every scan's evidence; poses are in cells of the grid."""
    size = hits.shape[0]
    # The last scan that hit or looked through a cell: each counts once per scan.
    hit_by = np.full((size, size), -1, dtype=np.int64)
    passed_by = np.full((size, size), -1, dtype=np.int64)
    beams = angles.shape[0]
    reach = np.empty(beams, dtype=np.float64)
    ends = np.empty((beams, 2), dtype=np.float64)
    for scan in range(ranges.shape[0]):
        x, y, yaw = poses[scan]
        _fill_reach(ranges[scan], range_max, reach)
        for beam in range(beams):
            length, direction = reach[beam] / resolution, yaw + angles[beam]
            ends[beam, 0] = length * math.cos(direction)
            ends[beam, 1] = length * math.sin(direction)
            if _is_return(ranges[scan, beam], range_max):
                column, row = math.floor(x + ends[beam, 0]), math.floor(y + ends[beam, 1])
                inside = 0 <= row < size and 0 <= column < size
                if inside and hit_by[row, column] != scan:
                    hit_by[row, column] = scan
                    hits[row, column] += 1
        for beam in range(beams):
            _mark_passes(x, y, ends[beam, 0], ends[beam, 1], scan, hit_by, passed_by, passes)


@compiled
def _is_return(reading: float, range_max: float) -> bool:
    return 0.0 < reading <= range_max


@compiled
def _fill_reach(scan: Float32Array, range_max: float, reach: FloatArray) -> None:
    """Say how far [m] each beam of a scan shows anything."""
    nearest = math.inf
    for beam in range(scan.shape[0]):
        if _is_return(scan[beam], range_max):
            nearest = scan[beam]
        reach[beam] = nearest
    nearest = math.inf
    for beam in range(scan.shape[0] - 1, -1, -1):
        if _is_return(scan[beam], range_max):
            nearest = scan[beam]
        reach[beam] = min(reach[beam], nearest, range_max)


@compiled
def _mark_passes(
    x: float,
    y: float,
    dx: float,
    dy: float,
    scan: int,
    hit_by: IntArray,
    passed_by: IntArray,
    passes: IntArray,
) -> None:
    """Walk the cells under a segment from (x, y) by (dx, dy) [cells] (Amanatides and Woo)."""
    size = passes.shape[0]
    enter, leave = 0.0, 1.0
    for start, delta in ((x, dx), (y, dy)):
        if delta == 0.0:
            if not 0.0 <= start < size:
                return
            continue
        first, second = -start / delta, (size - start) / delta
        enter = max(enter, min(first, second))
        leave = min(leave, max(first, second))
    if enter >= leave:
        return
    column = min(max(math.floor(x + enter * dx), 0), size - 1)
    row = min(max(math.floor(y + enter * dy), 0), size - 1)
    # Share of the segment between two borders, and at the next border, along each axis.
    across, along = math.inf, math.inf
    next_x, next_y = math.inf, math.inf
    if dx != 0.0:
        across = abs(1.0 / dx)
        next_x = (column + (1.0 if dx > 0.0 else 0.0) - x) / dx
    if dy != 0.0:
        along = abs(1.0 / dy)
        next_y = (row + (1.0 if dy > 0.0 else 0.0) - y) / dy
    while True:
        if hit_by[row, column] != scan and passed_by[row, column] != scan:
            passed_by[row, column] = scan
            passes[row, column] += 1
        if min(next_x, next_y) >= leave:
            return
        if next_x < next_y:
            column += 1 if dx > 0.0 else -1
            next_x += across
        else:
            row += 1 if dy > 0.0 else -1
            next_y += along
        if not (0 <= column < size and 0 <= row < size):
            return
