"""Which cells a shape touches, seen from above: convex polygons, discs and slabs of triangles.

A cell is touched where the shape covers any part of it, however small; touching only its edge is
not enough. So walls thinner than a cell do not vanish, and shapes that end on cell edges cover
just the cells between them.
"""

import math

import numpy as np

from ses_core.arrays import BoolArray, Float32Array, FloatArray
from ses_core.compilation import compiled

_TOLERANCE_CELLS = 1e-3
"""Less than this into a cell is not in it: coordinates in single precision are no better."""

_INWARD_CELLS = 2e-3
"""An upright face stands in the cell behind it, also where it lies on a cell edge."""

_FLAT_M = 1e-6


def mark_polygon(
    cells: BoolArray, points: FloatArray, *, origin: tuple[float, float], resolution: float
) -> None:
    """Mark the cells (H, W) that a convex polygon (K, 2) [m] touches."""
    scaled = (np.asarray(points, dtype=np.float64) - np.asarray(origin)) / resolution
    _mark_convex(
        cells, np.ascontiguousarray(scaled[:, 0]), np.ascontiguousarray(scaled[:, 1]), len(scaled)
    )


def mark_disc(
    cells: BoolArray,
    centre: tuple[float, float],
    radius: float,
    *,
    origin: tuple[float, float],
    resolution: float,
) -> None:
    """Mark the cells (H, W) that a disc of a radius [m] touches."""
    x, y = ((centre[axis] - origin[axis]) / resolution for axis in (0, 1))
    reach = radius / resolution
    left, bottom = (max(0, math.floor(place - reach)) for place in (x, y))
    window = cells[bottom : math.ceil(y + reach) + 1, left : math.ceil(x + reach) + 1]
    # From the centre to the nearest point of each cell.
    across = np.abs(left + np.arange(window.shape[1]) + 0.5 - x) - 0.5
    along = np.abs(bottom + np.arange(window.shape[0]) + 0.5 - y) - 0.5
    nearest = np.hypot(np.maximum(across, 0.0), np.maximum(along, 0.0)[:, None])
    window |= nearest < max(reach - _TOLERANCE_CELLS, _TOLERANCE_CELLS)


def mark_slab(
    cells: BoolArray,
    triangles: Float32Array,
    *,
    low: float,
    high: float,
    origin: tuple[float, float],
    resolution: float,
) -> None:
    """Mark the cells (H, W) touched by what of triangles (N, 3, 3) [m] lies between two heights."""
    _mark_triangles(cells, triangles, low, high, origin[0], origin[1], resolution)


@compiled
def _mark_triangles(
    cells: BoolArray,
    triangles: Float32Array,
    low: float,
    high: float,
    origin_x: float,
    origin_y: float,
    resolution: float,
) -> None:
    # A triangle cut by two planes has five corners at most; one more place each for the cut.
    first, second = np.empty((8, 3)), np.empty((8, 3))
    xs, ys = np.empty(8), np.empty(8)
    for index in range(triangles.shape[0]):
        triangle = triangles[index]
        bottom = min(triangle[0, 2], triangle[1, 2], triangle[2, 2])
        top = max(triangle[0, 2], triangle[1, 2], triangle[2, 2])
        if top <= low + _FLAT_M or bottom >= high - _FLAT_M:
            continue
        for corner in range(3):
            for axis in range(3):
                first[corner, axis] = triangle[corner, axis]
        count = _cut(first, 3, second, low, 1.0)
        count = _cut(second, count, first, high, -1.0)
        if count < 1:
            continue
        inward_x, inward_y = _inward(triangle)
        for corner in range(count):
            xs[corner] = (first[corner, 0] - origin_x) / resolution + inward_x
            ys[corner] = (first[corner, 1] - origin_y) / resolution + inward_y
        _mark_convex(cells, xs, ys, count)


@compiled
def _inward(triangle: Float32Array) -> tuple[float, float]:
    """Give the step in cells against a face's normal: from its surface into its solid."""
    ax, ay, az = (
        triangle[1, 0] - triangle[0, 0],
        triangle[1, 1] - triangle[0, 1],
        triangle[1, 2] - triangle[0, 2],
    )
    bx, by, bz = (
        triangle[2, 0] - triangle[0, 0],
        triangle[2, 1] - triangle[0, 1],
        triangle[2, 2] - triangle[0, 2],
    )
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    length = math.sqrt(nx * nx + ny * ny + nz * nz)
    if length == 0.0:
        return 0.0, 0.0
    return -_INWARD_CELLS * nx / length, -_INWARD_CELLS * ny / length


@compiled
def _cut(source: FloatArray, count: int, target: FloatArray, height: float, side: float) -> int:
    """Keep what of a polygon lies above (side 1) or below (side -1) a height."""
    kept = 0
    for index in range(count):
        after = index + 1 if index + 1 < count else 0
        here = side * (source[index, 2] - height)
        there = side * (source[after, 2] - height)
        if here >= 0.0:
            target[kept] = source[index]
            kept += 1
        if (here > 0.0 and there < 0.0) or (here < 0.0 and there > 0.0):
            share = here / (here - there)
            for axis in range(3):
                target[kept, axis] = source[index, axis] + share * (
                    source[after, axis] - source[index, axis]
                )
            kept += 1
    return kept


@compiled
def _mark_convex(cells: BoolArray, xs: FloatArray, ys: FloatArray, count: int) -> None:
    """Mark what a convex polygon touches, row by row; its corners are in cells."""
    low, high = ys[:count].min(), ys[:count].max()
    first = max(0, math.floor(low + _TOLERANCE_CELLS))
    last = min(
        cells.shape[0] - 1,
        max(math.floor(low + _TOLERANCE_CELLS), math.ceil(high - _TOLERANCE_CELLS) - 1),
    )
    for row in range(first, last + 1):
        bottom = min(max(float(row), low), high)
        top = max(min(row + 1.0, high), bottom)
        left, right = np.inf, -np.inf
        for index in range(count):
            after = index + 1 if index + 1 < count else 0
            y0, y1 = ys[index], ys[after]
            x0, x1 = xs[index], xs[after]
            if max(y0, y1) < bottom or min(y0, y1) > top:
                continue
            if y0 == y1:
                left, right = min(left, x0, x1), max(right, x0, x1)
                continue
            for edge in (bottom, top):
                # The end of the side, where the band's edge lies beyond it.
                share = min(max((edge - y0) / (y1 - y0), 0.0), 1.0)
                x = x0 + share * (x1 - x0)
                left, right = min(left, x), max(right, x)
        if left > right:
            continue
        start = math.floor(left + _TOLERANCE_CELLS)
        stop = max(start, math.ceil(right - _TOLERANCE_CELLS) - 1)
        for column in range(max(0, start), min(cells.shape[1] - 1, stop) + 1):
            cells[row, column] = True
