"""Furnished homes from a seed: rooms, corridors, doors of real widths, furniture.

Their statistics were brought close to those of scanned, furnished houses (`docs/worlds.md`):
size, share that is free, widths between opposite sides, what a robot meets on its way, and how
often DWA slow has a hard time. Other than those, nearly every home has places far apart that a
Jackal gets between: homes that have none are drawn again.
"""

import math

import numpy as np
from numpy.random import Generator
from scipy import ndimage

from ses_core.arrays import BoolArray
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import JACKAL
from ses_core.worlds.furniture import Piece, furniture_for, stamp
from ses_core.worlds.home_layout import (
    RESOLUTION_M,
    Doorway,
    Room,
    in_cells,
    lay_out,
)
from ses_core.worlds.identity import named_world
from ses_core.worlds.pairs import standing_places

MEDIAN_LENGTH_M = 21.0
LENGTHS_M = (12.0, 38.0)
_LENGTH_SPREAD = 0.35
_HEIGHT_SHARES = (0.5, 0.85)

PASSAGE_RADII_M = (0.2, 0.4)
"""Between a room's doors furniture leaves a disc of this radius room, drawn once per room."""

LIVING_RADII_M = (0.6, 1.3)
"""The same in the living area: a Jackal's padded circumscribed 0.408 m and ease."""

COVERED_SHARES = (0.45, 0.75)
"""Share of a room's floor under furniture."""

LIVING_COVERED_SHARES = (0.2, 0.5)
"""The same in the living area."""

FUSED_CELLS = (1, 4)
"""Gaps of less than this many cells, drawn once per home, are filled as scans fill them."""

FARTHEST_PLACES_M = 9.0
"""A home has places so far apart that a Jackal gets between."""

LEAST_SIDES_M = (6.0, 12.0)
"""Smallest ground: on less, homes with such places are rare or impossible."""

_TRIES = 8
_TURNED_SHARE = 0.3
_CORNER_SHARE = 0.4


def generate_homes(
    count: int, *, seed: int, sides_m: tuple[float, float] | None = None
) -> list[World]:
    """Generate homes 0 to count - 1 of a seed; home i does not depend on the others."""
    return [generate_home(index, seed=seed, sides_m=sides_m) for index in range(count)]


def generate_home(index: int, *, seed: int, sides_m: tuple[float, float] | None = None) -> World:
    """Generate one home, on a ground of given height and length [m] or one of usual size.

    Raises:
        ValueError: The ground is too small.
    """
    if sides_m is not None and (min(sides_m) < LEAST_SIDES_M[0] or max(sides_m) < LEAST_SIDES_M[1]):
        raise ValueError(
            f"home has {sides_m[0]:g} x {sides_m[1]:g} m of ground, "
            f"expected at least {LEAST_SIDES_M[0]:g} x {LEAST_SIDES_M[1]:g} m"
        )
    rng = np.random.default_rng([seed, index])
    while True:
        layout = lay_out(sides_m or _draw_sides(rng), rng=rng)
        for room in layout.rooms:
            _furnish(layout.cells, room, rng=rng)
        cells = _trimmed(_fused(layout.cells, int(rng.integers(*FUSED_CELLS))))
        if sides_m is None and rng.random() < 0.5:
            cells = cells.T
        grid = OccupancyGrid(cells=np.ascontiguousarray(cells), resolution=RESOLUTION_M)
        if _has_places_far_apart(grid):
            return named_world(f"home-{seed}-{index:04d}", grid, source="home")


def _draw_sides(rng: Generator) -> tuple[float, float]:
    length = float(np.clip(MEDIAN_LENGTH_M * math.exp(_LENGTH_SPREAD * rng.normal()), *LENGTHS_M))
    return length * rng.uniform(*_HEIGHT_SHARES), length


def _has_places_far_apart(grid: OccupancyGrid) -> bool:
    """Tell whether the largest region to stand in is far enough across."""
    places = standing_places(grid, JACKAL)
    if not len(places.points):
        return False
    largest = places.points[places.regions == np.bincount(places.regions).argmax()]
    return float(np.linalg.norm(np.ptp(largest, axis=0))) >= FARTHEST_PLACES_M


def _fused(cells: BoolArray, reach: int) -> BoolArray:
    """Close gaps up to `reach` cells wide: chairs and their table become one obstacle."""
    margin = reach + 1
    padded = np.pad(cells, margin, constant_values=True)
    square = np.ones((reach + 1, reach + 1), dtype=np.bool_)
    closed = ndimage.binary_closing(padded, structure=square)
    return closed[margin:-margin, margin:-margin] | cells


def _trimmed(cells: BoolArray) -> BoolArray:
    """Cut off what is shut all along the outside, but for a wall."""
    rows, columns = (np.flatnonzero((~cells).any(axis=axis)) for axis in (1, 0))
    return cells[rows[0] - 1 : rows[-1] + 2, columns[0] - 1 : columns[-1] + 2]


def _furnish(cells: BoolArray, room: Room, *, rng: Generator) -> None:
    """Put furniture into a room, taking back what comes between two of its doorways."""
    window = cells[room.bottom : room.top, room.left : room.right]
    radius = rng.uniform(*(LIVING_RADII_M if room.is_living else PASSAGE_RADII_M))
    radius = min(radius, (min(window.shape) // 2 - 1) * RESOLUTION_M)
    accesses = [_access(room, doorway, in_cells(radius) + 1) for doorway in room.doorways]
    most = rng.uniform(*(LIVING_COVERED_SHARES if room.is_living else COVERED_SHARES)) * window.size
    for piece in furniture_for(room.area_m2, is_corridor=room.is_corridor, rng=rng):
        for _ in range(_TRIES):
            if window.sum() >= most:
                return
            covered = _put(piece, window.shape, rng)
            if covered is None or (covered & window).any():
                continue
            if _stays_open(window | covered, accesses, radius):
                window |= covered
                break


def _put(piece: Piece, shape: tuple[int, ...], rng: Generator) -> BoolArray | None:
    """Find a place for a piece in a room (H, W): its cells, or None where it is too large."""
    height, width = shape[0] * RESOLUTION_M, shape[1] * RESOLUTION_M
    side = int(rng.integers(4))
    along, away = (width, height) if side % 2 == 0 else (height, width)
    if piece.length > along or piece.depth > away:
        return None
    yaw = side * math.pi / 2
    u = rng.uniform(piece.length / 2, along - piece.length / 2)
    if piece.at_wall and rng.random() < _CORNER_SHARE:
        u = piece.length / 2 if rng.random() < 0.5 else along - piece.length / 2
    v = 0.0
    if not piece.at_wall:
        v = rng.uniform(piece.depth / 2, away - piece.depth / 2)
        yaw += rng.normal(0.0, 0.4) if rng.random() < _TURNED_SHARE else 0.0
    x, y = ((u, v), (width - v, u), (width - u, height - v), (v, height - u))[side]
    return stamp(piece, (shape[0], shape[1]), (x, y), yaw)


def _access(room: Room, doorway: Doorway, depth: int) -> tuple[int, int]:
    """Give the cell (row, column) of a room, counted from its corner, behind a doorway."""
    row = (doorway.rows.start + doorway.rows.stop) // 2 - room.bottom
    column = (doorway.columns.start + doorway.columns.stop) // 2 - room.left
    return _inside(row, room.top - room.bottom, depth), _inside(
        column, room.right - room.left, depth
    )


def _inside(place: int, extent: int, depth: int) -> int:
    """Move a place to at least a depth inside an extent, or to its middle; all in cells."""
    depth = min(depth, extent // 2)
    return min(max(place, depth), extent - 1 - depth)


def _stays_open(occupied: BoolArray, accesses: list[tuple[int, int]], radius: float) -> bool:
    """Tell whether a disc still gets from every doorway of a room to every other."""
    clearance = ndimage.distance_transform_edt(np.pad(~occupied, 1)) * RESOLUTION_M
    regions, _ = ndimage.label(clearance[1:-1, 1:-1] > radius - RESOLUTION_M)
    entered = {int(regions[row, column]) for row, column in accesses}
    return 0 not in entered and len(entered) == 1
