"""A planar laser in an occupancy grid: exact ray casting that skips open space."""

import math

import numpy as np

from ses_core.arrays import BoolArray, ByteArray, Float32Array, FloatArray
from ses_core.compilation import compiled, compiled_in_place


@compiled
def chessboard_clearance(occupied: BoolArray) -> ByteArray:
    """Give each cell's chessboard distance to the nearest occupied one, at most 255; exact.

    Two sweeps suffice for this metric (Rosenfeld and Pfaltz 1968).
    """
    height, width = occupied.shape
    clearance = np.empty((height, width), dtype=np.uint8)
    for row in range(height):
        for column in range(width):
            best = 0 if occupied[row, column] else 255
            if best:
                if column > 0:
                    best = min(best, clearance[row, column - 1] + 1)
                if row > 0:
                    first, last = max(column - 1, 0), min(column + 1, width - 1)
                    for above in range(first, last + 1):
                        best = min(best, clearance[row - 1, above] + 1)
            clearance[row, column] = best
    for row in range(height - 1, -1, -1):
        for column in range(width - 1, -1, -1):
            best = int(clearance[row, column])
            if column < width - 1:
                best = min(best, clearance[row, column + 1] + 1)
            if row < height - 1:
                first, last = max(column - 1, 0), min(column + 1, width - 1)
                for below in range(first, last + 1):
                    best = min(best, clearance[row + 1, below] + 1)
            clearance[row, column] = best
    return clearance


@compiled_in_place
def cast(
    clearance: ByteArray,
    offset: int,
    width: int,
    height: int,
    x: float,
    y: float,
    along_x: float,
    along_y: float,
    limit: float,
) -> float:
    """Follow one ray to the face of the first occupied cell; all lengths in cells.

    The grid has to be walled all round.

    From a cell at chessboard distance n the ray may advance n - 1 cells along its faster axis
    and meets nothing; next to an obstacle it goes from cell face to cell face (Amanatides and
    Woo 1987). The result is that of the plain walk.
    The direction (along_x, along_y) has unit length.

    Returns:
        The distance, or inf where nothing was hit up to `limit`; leaving the grid is a hit.
    """
    column, row = math.floor(x), math.floor(y)
    step_x, step_y = (1 if along_x > 0.0 else -1), (1 if along_y > 0.0 else -1)
    inverse_x = 1.0 / along_x if along_x != 0.0 else math.inf
    inverse_y = 1.0 / along_y if along_y != 0.0 else math.inf
    face_x, face_y = (1 if along_x > 0.0 else 0), (1 if along_y > 0.0 else 0)
    pace = 1.0 / max(abs(along_x), abs(along_y))
    travelled = 0.0
    while travelled <= limit:
        if column < 0 or row < 0 or column >= width or row >= height:
            return travelled
        near = int(clearance[offset + row * width + column])
        if near == 0:
            return travelled
        if near > 2:
            travelled += (near - 1) * pace
            # Inside the grid coordinates are positive: cutting off is cheaper than rounding down.
            column = int(x + travelled * along_x)
            row = int(y + travelled * along_y)
            continue
        to_x = (column + face_x - x) * inverse_x if along_x != 0.0 else math.inf
        to_y = (row + face_y - y) * inverse_y if along_y != 0.0 else math.inf
        # Which face comes first is as good as random: selecting is cheaper than branching.
        is_column = to_x < to_y
        column += step_x if is_column else 0
        row += 0 if is_column else step_y
        travelled = max(travelled, to_x if is_column else to_y)
    return math.inf


@compiled_in_place
def cast_scan(
    ranges: Float32Array,
    clearance: ByteArray,
    offset: int,
    width: int,
    height: int,
    resolution: float,
    x: float,
    y: float,
    yaw: float,
    beams: FloatArray,
    range_min: float,
    range_max: float,
) -> None:
    """Fill one noiseless scan (B,) [m] from a laser at (x, y, yaw) in the grid's frame [m, rad].

    Readings outside [range_min, range_max] become inf, as where nothing was hit. The beams (B, 2)
    are unit vectors in the laser's frame.
    """
    cosine, sine = math.cos(yaw), math.sin(yaw)
    for beam in range(beams.shape[0]):
        distance = resolution * cast(
            clearance,
            offset,
            width,
            height,
            x / resolution,
            y / resolution,
            cosine * beams[beam, 0] - sine * beams[beam, 1],
            sine * beams[beam, 0] + cosine * beams[beam, 1],
            range_max / resolution,
        )
        ranges[beam] = distance if range_min <= distance <= range_max else np.inf
