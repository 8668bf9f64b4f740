"""Which cells a laser's beams pass over: those at whole steps along a beam's faster axis."""

import math

import numpy as np

from ses_core.arrays import Float32Array, FloatArray
from ses_core.compilation import compiled_in_place

_HALF_DIAGONAL = 0.7072  # of a cell, rounded up
_FAN = 8  # fewest beams whose spacing tells how they lie


@compiled_in_place
def beams_per_radian(beams: FloatArray) -> float:
    """Give how many of the evenly spaced beams (B, 2) a radian holds, 0 where they cannot tell.

    Negative where they run clockwise. Few beams may be more than half a turn apart.
    """
    spacing = math.atan2(
        beams[0, 0] * beams[1, 1] - beams[0, 1] * beams[1, 0],
        beams[0, 0] * beams[1, 0] + beams[0, 1] * beams[1, 1],
    )
    return 1.0 / spacing if beams.shape[0] >= _FAN and spacing != 0.0 else 0.0


@compiled_in_place
def is_passed(
    ranges: Float32Array,
    beams: FloatArray,
    per_radian: float,
    column: float,
    row: float,
    cosine: float,
    sine: float,
    cell_column: int,
    cell_row: int,
    resolution: float,
    reach: float,
) -> bool:
    """Tell whether some beam passes over a cell, trying those that its angle leaves.

    The laser is at (column, row) [cells], turned by an angle of that cosine and sine; its ranges
    (B,) and how far a beam can reach are in m.
    """
    away_x, away_y = cell_column + 0.5 - column, cell_row + 0.5 - row
    first_x = cosine * beams[0, 0] - sine * beams[0, 1]
    first_y = sine * beams[0, 0] + cosine * beams[0, 1]
    angle = math.atan2(first_x * away_y - first_y * away_x, first_x * away_x + first_y * away_y)
    distance = math.sqrt(away_x * away_x + away_y * away_y)
    nearest = (distance - _HALF_DIAGONAL) * resolution
    # Half the angle under which the laser sees the cell, or all around. For the arc sine stands
    # a polynomial that is nowhere below it.
    share = _HALF_DIAGONAL / distance
    spread = share + 0.571 * share**3 if share < 1.0 else math.pi
    # A fan may be turned by more than half a turn from its first beam, either way.
    for turn in range(-1, 2):
        middle, around = (angle + turn * 2.0 * math.pi) * per_radian, spread * abs(per_radian)
        first, last = 0, ranges.shape[0] - 1
        if per_radian != 0.0:
            first, last = max(int(middle - around), first), min(int(middle + around), last)
        for beam in range(first, last + 1):
            if nearest <= ranges[beam] < np.inf and _passes(
                cosine * beams[beam, 0] - sine * beams[beam, 1],
                sine * beams[beam, 0] + cosine * beams[beam, 1],
                min(ranges[beam], reach) / resolution,
                column,
                row,
                cell_column,
                cell_row,
            ):
                return True
    return False


@compiled_in_place
def _passes(
    along_x: float,
    along_y: float,
    length: float,
    column: float,
    row: float,
    cell_column: int,
    cell_row: int,
) -> bool:
    """Tell whether a beam of a length [cells] from (column, row) passes over or ends on a cell."""
    pace = max(abs(along_x), abs(along_y))
    along_x, along_y = along_x / pace, along_y / pace
    away_x, away_y = abs(cell_column - int(column)), abs(cell_row - int(row))
    step = away_x if abs(along_x) == 1.0 else away_y
    return (
        step <= int(length * pace)
        and int(column + step * along_x) == cell_column
        and int(row + step * along_y) == cell_row
    )
