"""Homes from a seed: rooms along a corridor, doors, furniture.

A home is a rectangle with a corridor along it and rooms on one or both sides. Every room has a
door to the corridor, some have one to the next room, some neighbours are one large room.
Furniture stands along walls or in the middle, and only where a Jackal still gets from every
door to every other.

Widths are wider than in flats: doors of 0.8 to 1.2 m stopped DWA slow at two of three goals in a
first run. They were chosen on how often it arrives, so that figure says nothing about how true
to life the homes are.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.random import Generator
from scipy import ndimage

from ses_core.arrays import BoolArray
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.identity import named_world

RESOLUTION_M = 0.05
WALL_M = 0.1
DOOR_WIDTHS_M = (1.0, 1.5)
CORRIDOR_WIDTHS_M = (1.4, 2.0)
ROOM_WIDTHS_M = (2.8, 5.0)
ROOM_DEPTHS_M = (3.0, 4.8)
HOME_LENGTHS_M = (11.0, 17.0)

_PASSAGE_RADIUS_M = 0.45
"""Furniture leaves this radius free: a Jackal's padded circumscribed 0.408 m and some ease."""

_FURNITURE = (
    ((2.0, 1.6), "wall"),
    ((2.0, 0.9), "wall"),
    ((1.2, 0.6), "wall"),
    ((1.4, 0.7), "wall"),
    ((0.8, 0.4), "wall"),
    ((1.4, 0.9), "middle"),
    ((0.9, 0.9), "middle"),
    ((0.45, 0.45), "middle"),
    ((0.45, 0.45), "middle"),
)
"""Length and depth [m] of what stands in a room, and where: bed, sofa, wardrobe, desk, shelf;
table, round table, chairs."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Room:
    """A room's inner rectangle in cells, [bottom, top) x [left, right)."""

    bottom: int
    top: int
    left: int
    right: int


def generate_homes(count: int, *, seed: int) -> list[World]:
    """Generate homes 0 to count - 1 of a seed; home i does not depend on the others."""
    return [generate_home(index, seed=seed) for index in range(count)]


def generate_home(index: int, *, seed: int) -> World:
    """Generate one home."""
    rng = np.random.default_rng([seed, index])
    cells, rooms = _build_rooms(rng)
    _furnish(cells, rooms, rng=rng)
    if rng.random() < 0.5:
        cells = cells.T
    grid = OccupancyGrid(cells=np.ascontiguousarray(cells), resolution=RESOLUTION_M)
    return named_world(f"home-{seed}-{index:04d}", grid, source="home")


def _build_rooms(rng: Generator) -> tuple[BoolArray, list[_Room]]:
    """Build walls and doors; give the cells and the rooms, corridor left out."""
    wall = _cells(WALL_M)
    length = _draw(HOME_LENGTHS_M, rng)
    corridor = _draw(CORRIDOR_WIDTHS_M, rng)
    below = _draw(ROOM_DEPTHS_M, rng)
    above = _draw(ROOM_DEPTHS_M, rng) if rng.random() < 0.8 else 0
    height = below + corridor + 3 * wall + (above + wall if above else 0)
    cells = np.ones((height, length), dtype=np.bool_)
    corridor_bottom = below + 2 * wall
    cells[corridor_bottom : corridor_bottom + corridor, wall:-wall] = False
    rooms = []
    strips = [(wall, wall + below, corridor_bottom - wall)]
    if above:
        bottom = corridor_bottom + corridor + wall
        strips.append((bottom, bottom + above, bottom - wall))
    for bottom, top, door_wall in strips:
        row = [
            _Room(bottom=bottom, top=top, left=left, right=right)
            for left, right in _split(wall, length - wall, wall, rng)
        ]
        for room in row:
            cells[room.bottom : room.top, room.left : room.right] = False
            left, right = _doorway(room.left, room.right, rng)
            cells[door_wall : door_wall + wall, left:right] = False
        for room, following in pairwise(row):
            _join(cells, room, following, rng=rng)
        rooms.extend(row)
    return cells, rooms


def _split(first: int, last: int, wall: int, rng: Generator) -> Iterator[tuple[int, int]]:
    """Divide [first, last) into rooms with walls between them."""
    left, narrowest = first, _cells(ROOM_WIDTHS_M[0])
    while True:
        right = left + _draw(ROOM_WIDTHS_M, rng)
        if last - (right + wall) < narrowest:
            yield left, last
            return
        yield left, right
        left = right + wall


def _join(cells: BoolArray, room: _Room, following: _Room, *, rng: Generator) -> None:
    """Open the wall between two neighbours: as one room, by a door, or not at all."""
    kind = rng.random()
    if kind < 0.15:
        cells[room.bottom : room.top, room.right : following.left] = False
    elif kind < 0.5:
        bottom, top = _doorway(room.bottom, room.top, rng)
        cells[bottom:top, room.right : following.left] = False


def _doorway(first: int, last: int, rng: Generator) -> tuple[int, int]:
    """Place a door in the wall [first, last), off its ends."""
    width, edge = _draw(DOOR_WIDTHS_M, rng), _cells(0.15)
    begin = int(rng.integers(first + edge, last - width - edge + 1))
    return begin, begin + width


def _furnish(cells: BoolArray, rooms: list[_Room], *, rng: Generator) -> None:
    """Put furniture in, piece by piece, taking back what shuts any free place off."""
    for room in rooms:
        for piece in rng.permutation(len(_FURNITURE))[: int(rng.integers(2, 6))]:
            size, place = _FURNITURE[piece]
            box = _place(room, size, place, rng)
            if box is None or cells[box].any():
                continue
            before = _passage_regions(cells)
            cells[box] = True
            if _passage_regions(cells) > before:
                cells[box] = False


def _place(
    room: _Room, size: tuple[float, float], place: str, rng: Generator
) -> tuple[slice, slice] | None:
    """Find a box's cells in a room, its long side along a wall or turned at random."""
    length, depth = _cells(size[0]), _cells(size[1])
    along_x = bool(rng.random() < 0.5)
    tall, wide = (depth, length) if along_x else (length, depth)
    highest, rightmost = room.top - tall, room.right - wide
    if highest < room.bottom or rightmost < room.left:
        return None
    bottom = int(rng.integers(room.bottom, highest + 1))
    left = int(rng.integers(room.left, rightmost + 1))
    if place == "wall":
        far = bool(rng.random() < 0.5)
        if along_x:
            bottom = highest if far else room.bottom
        else:
            left = rightmost if far else room.left
    return slice(bottom, bottom + tall), slice(left, left + wide)


def _passage_regions(cells: BoolArray) -> int:
    """Count the regions a disc of the passage radius can move in without leaving."""
    clearance = ndimage.distance_transform_edt(~cells) * RESOLUTION_M
    _, count = ndimage.label(clearance > _PASSAGE_RADIUS_M)
    return int(count)


def _draw(bounds_m: tuple[float, float], rng: Generator) -> int:
    """Draw a length between bounds [m], in cells."""
    return int(rng.integers(_cells(bounds_m[0]), _cells(bounds_m[1]) + 1))


def _cells(length_m: float) -> int:
    return round(length_m / RESOLUTION_M)
