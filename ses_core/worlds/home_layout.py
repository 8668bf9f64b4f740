"""Where a home has rooms, corridors, doors and openings.

A rectangle is divided again and again; large parts get a corridor through their middle. Rooms
that share a wall are neighbours: a random tree of doors joins all of them, a few more make
rounds. Part of the floor is the living area, whose rooms open wide to each other; other rooms
have doors a robot does not always get through. Some at the ends of the tree stay shut: shafts,
stairs and what was never entered give real homes their ragged outline.
"""

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.random import Generator

from ses_core.arrays import BoolArray

RESOLUTION_M = 0.05

DOOR_WIDTHS_M = (0.7, 0.95)
"""Clear widths of doors of single leaves: a Jackal is 0.53 m wide with its padding."""

WIDE_DOOR_WIDTHS_M = (1.0, 1.8)
"""Entrances, double doors and plain passages: between the rooms of the living area."""

OPENING_WIDTHS_M = (1.7, 8.0)
CORRIDOR_WIDTHS_M = (1.1, 1.8)
WALLS_M = (0.15, 0.45)
ROOM_AREAS_M2 = (7.0, 45.0)
LEAST_ROOM_SIDE_M = 2.0

LIVING_SHARES = (0.1, 0.33)
"""Share of the floor that is one area of rooms open to each other."""

SHUT_SHARES = (0.2, 0.55)
"""Share of the floor that is shut."""

_CORRIDOR_FROM_M2 = 90.0
_CORRIDOR_SHARE = 0.15
_OPENING_SHARE = 0.75
_ROUND_SHARE = 0.3
_DOOR_EDGE_M = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Doorway:
    """An opening in a wall, in cells: rows and columns that are free."""

    rows: slice
    columns: slice


@dataclass(slots=True, kw_only=True)
class Room:
    """A room's inner rectangle in cells, [bottom, top) x [left, right), and its doorways."""

    bottom: int
    top: int
    left: int
    right: int
    is_corridor: bool = False
    is_living: bool = False
    doorways: list[Doorway] = field(default_factory=list)

    @property
    def area_m2(self) -> float:
        """Area of the floor."""
        return (self.top - self.bottom) * (self.right - self.left) * RESOLUTION_M**2


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """A home without furniture: cells (H, W), True = occupied, and the rooms that are open."""

    cells: BoolArray
    rooms: list[Room]


def lay_out(sides_m: tuple[float, float], *, rng: Generator) -> Layout:
    """Lay a home out on a ground of given height and length [m]."""
    wall = draw_cells(WALLS_M, rng)
    height, length = (in_cells(side) for side in sides_m)
    whole = Room(bottom=wall, top=height - wall, left=wall, right=length - wall)
    rooms = _divide(whole, wall, rng)
    tree, rounds = _joined(rooms, wall, rng)
    _choose_living(rooms, tree, rng)
    shut = _choose_shut(rooms, tree, rng)
    cells = np.ones((height, length), dtype=np.bool_)
    for number, room in enumerate(rooms):
        cells[room.bottom : room.top, room.left : room.right] = number in shut
    for first, second in (*tree, *rounds):
        if shut.isdisjoint((first, second)):
            doorway = _doorway(rooms[first], rooms[second], wall, rng)
            cells[doorway.rows, doorway.columns] = False
            rooms[first].doorways.append(doorway)
            rooms[second].doorways.append(doorway)
    return Layout(cells=cells, rooms=[room for n, room in enumerate(rooms) if n not in shut])


def in_cells(length_m: float) -> int:
    """Round a length [m] to cells."""
    return round(length_m / RESOLUTION_M)


def draw_cells(bounds_m: tuple[float, float], rng: Generator) -> int:
    """Draw a length between bounds [m], in cells."""
    return int(rng.integers(in_cells(bounds_m[0]), in_cells(bounds_m[1]) + 1))


def _divide(room: Room, wall: int, rng: Generator) -> list[Room]:
    """Divide a part of a home into rooms."""
    along_rows = room.top - room.bottom > room.right - room.left
    longer = max(room.top - room.bottom, room.right - room.left)
    shorter = min(room.top - room.bottom, room.right - room.left)
    least = in_cells(LEAST_ROOM_SIDE_M)
    if room.area_m2 < rng.uniform(*ROOM_AREAS_M2) or longer < 2 * least + wall:
        return [room]
    corridor = draw_cells(CORRIDOR_WIDTHS_M, rng)
    wide_enough = shorter >= 2 * (least + wall) + corridor
    if wide_enough and room.area_m2 > _CORRIDOR_FROM_M2 and rng.random() < _CORRIDOR_SHARE:
        begin = int(rng.integers(least + wall, shorter - least - wall - corridor + 1))
        near = _part(room, not along_rows, 0, begin - wall)
        middle = _part(room, not along_rows, begin, begin + corridor)
        far = _part(room, not along_rows, begin + corridor + wall, shorter)
        middle.is_corridor = True
        return [*_divide(near, wall, rng), middle, *_divide(far, wall, rng)]
    low = max(least, round(0.3 * longer))
    cut = int(rng.integers(low, longer - wall - low + 1)) if longer >= 2 * low + wall else least
    return [
        *_divide(_part(room, along_rows, 0, cut), wall, rng),
        *_divide(_part(room, along_rows, cut + wall, longer), wall, rng),
    ]


def _part(room: Room, along_rows: bool, begin: int, end: int) -> Room:
    if along_rows:
        return Room(
            bottom=room.bottom + begin, top=room.bottom + end, left=room.left, right=room.right
        )
    return Room(bottom=room.bottom, top=room.top, left=room.left + begin, right=room.left + end)


def _joined(
    rooms: list[Room], wall: int, rng: Generator
) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """List the neighbours that a random tree joins, and some more that make rounds.

    Corridors and large rooms are tried first: that is where doors lead.
    """
    pull = [4.0 if room.is_corridor else room.area_m2 / ROOM_AREAS_M2[1] for room in rooms]
    neighbours = sorted(
        (
            pair
            for pair in combinations(range(len(rooms)), 2)
            if _shared_wall(rooms[pair[0]], rooms[pair[1]], wall) is not None
        ),
        key=lambda pair: rng.exponential() / max(pull[pair[0]], pull[pair[1]]),
    )
    group = list(range(len(rooms)))
    tree, rounds = [], []
    for first, second in neighbours:
        old, new = group[first], group[second]
        if old != new:
            tree.append((first, second))
            group = [new if member == old else member for member in group]
        elif rng.random() < _ROUND_SHARE:
            rounds.append((first, second))
    return tree, rounds


def _choose_living(rooms: list[Room], tree: list[tuple[int, int]], rng: Generator) -> None:
    """Grow the living area along the tree from the largest room, large neighbours first."""
    wanted = rng.uniform(*LIVING_SHARES) * sum(room.area_m2 for room in rooms)
    max(rooms, key=lambda room: room.area_m2).is_living = True
    while sum(room.area_m2 for room in rooms if room.is_living) < wanted:
        beside = [
            rooms[second if rooms[first].is_living else first]
            for first, second in tree
            if rooms[first].is_living != rooms[second].is_living
        ]
        if not beside:
            return
        max(beside, key=lambda room: room.area_m2).is_living = True


def _choose_shut(rooms: list[Room], tree: list[tuple[int, int]], rng: Generator) -> set[int]:
    """Shut rooms outside the living area, always at an end of the tree."""
    wanted = rng.uniform(*SHUT_SHARES) * sum(room.area_m2 for room in rooms)
    shut: set[int] = set()
    while sum(rooms[number].area_m2 for number in shut) < wanted:
        left = [pair for pair in tree if shut.isdisjoint(pair)]
        doors = np.bincount(np.array(left, dtype=np.int64).ravel(), minlength=len(rooms))
        ends = [n for n, room in enumerate(rooms) if doors[n] == 1 and not room.is_living]
        if not ends:
            break
        shut.add(ends[int(rng.integers(len(ends)))])
    return shut


def _shared_wall(first: Room, second: Room, wall: int) -> tuple[bool, int, int, int] | None:
    """Give the wall between neighbours: if it is upright, its first cell, and from where to where.

    None where two rooms share no wall long enough for a door.
    """
    least = in_cells(WIDE_DOOR_WIDTHS_M[0] + 2 * _DOOR_EDGE_M)
    for one, other in ((first, second), (second, first)):
        if one.right + wall == other.left:
            begin, end = max(one.bottom, other.bottom), min(one.top, other.top)
            if end - begin >= least:
                return True, one.right, begin, end
        if one.top + wall == other.bottom:
            begin, end = max(one.left, other.left), min(one.right, other.right)
            if end - begin >= least:
                return False, one.top, begin, end
    return None


def _doorway(first: Room, second: Room, wall: int, rng: Generator) -> Doorway:
    """Place a door or a wide opening between neighbours, off the ends of their wall."""
    shared = _shared_wall(first, second, wall)
    assert shared is not None
    is_upright, across, begin, end = shared
    edge = in_cells(_DOOR_EDGE_M)
    bounds = DOOR_WIDTHS_M
    if first.is_living and second.is_living:
        bounds = OPENING_WIDTHS_M if rng.random() < _OPENING_SHARE else WIDE_DOOR_WIDTHS_M
    width = min(draw_cells(bounds, rng), end - begin - 2 * edge)
    start = int(rng.integers(begin + edge, end - edge - width + 1))
    through, along = slice(across, across + wall), slice(start, start + width)
    return (
        Doorway(rows=along, columns=through) if is_upright else Doorway(rows=through, columns=along)
    )
