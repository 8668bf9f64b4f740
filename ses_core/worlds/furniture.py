"""Furniture as a lidar near the floor sees it: what stands in a room of a kind, and how large.

A piece is made of rectangles and discs. Those against a wall have their x along it and y into
the room, from 0; those in the middle are centred. Tables show their tops as most occupancy maps
of homes do, one in ten only its legs.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ses_core.arrays import BoolArray
from ses_core.worlds.home_layout import RESOLUTION_M

_LEG_M = 0.1
_CHAIR_M = 0.45
_LEGS_SHARE = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A rectangle, or the disc in it, around (x, y) [m] in the frame of its piece."""

    x: float
    y: float
    length: float
    depth: float
    is_round: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """Furniture that stands together, and whether it stands against a wall."""

    parts: tuple[Part, ...]
    at_wall: bool

    @property
    def length(self) -> float:
        """Extent [m] along x."""
        return max(p.x + p.length / 2 for p in self.parts) - min(
            p.x - p.length / 2 for p in self.parts
        )

    @property
    def depth(self) -> float:
        """Extent [m] along y, from 0 for what stands at a wall."""
        low = 0.0 if self.at_wall else min(p.y - p.depth / 2 for p in self.parts)
        return max(p.y + p.depth / 2 for p in self.parts) - low


def furniture_for(area_m2: float, *, is_corridor: bool, rng: Generator) -> list[Piece]:
    """Choose what a room of an area [m2] is for, and its furniture, the important first."""
    makers: list[_Maker]
    if is_corridor:
        makers = [_cupboard] * int(rng.integers(0, 3))
    elif area_m2 < 6.5:
        makers = [_bathtub, _basin, _basin, _cupboard]
    else:
        rooms = _SMALL_ROOMS if area_m2 < 14.0 else _LARGE_ROOMS
        makers = list(rooms[int(rng.integers(len(rooms)))])
        makers += [_FILLERS[int(rng.integers(len(_FILLERS)))] for _ in range(int(area_m2 / 0.8))]
    return [maker(rng) for maker in makers]


def stamp(piece: Piece, shape: tuple[int, int], at: tuple[float, float], yaw: float) -> BoolArray:
    """Mark the cells (H, W) that a piece covers, standing at (x, y) [m] and turned by yaw."""
    rows, columns = np.indices(shape)
    x, y = (columns + 0.5) * RESOLUTION_M - at[0], (rows + 0.5) * RESOLUTION_M - at[1]
    along = math.cos(yaw) * x + math.sin(yaw) * y
    across = math.cos(yaw) * y - math.sin(yaw) * x
    covered = np.zeros(shape, dtype=np.bool_)
    for part in piece.parts:
        u, v = (along - part.x) / part.length, (across - part.y) / part.depth
        if part.is_round:
            covered |= u**2 + v**2 <= 0.25
        else:
            covered |= (np.abs(u) <= 0.5) & (np.abs(v) <= 0.5)
    return covered


def _box(length: float, depth: float, *, x: float = 0.0, y: float = 0.0) -> Part:
    """A rectangle whose near side is at y."""
    return Part(x=x, y=y + depth / 2, length=length, depth=depth)


def _at_wall(*parts: Part) -> Piece:
    return Piece(parts=parts, at_wall=True)


def _cupboard(rng: Generator) -> Piece:
    return _at_wall(_box(rng.uniform(0.6, 2.4), rng.uniform(0.3, 0.65)))


def _clutter(rng: Generator) -> Piece:
    return _at_wall(_box(rng.uniform(0.2, 0.7), rng.uniform(0.2, 0.6)))


def _counter(rng: Generator) -> Piece:
    length, side = rng.uniform(1.8, 3.6), rng.choice((-1.0, 1.0))
    if rng.random() < 0.5:
        return _at_wall(_box(length, 0.65))
    short = rng.uniform(1.2, 2.4)
    return _at_wall(_box(length, 0.65), _box(0.65, short, x=side * (length - 0.65) / 2))


def _bed(rng: Generator) -> Piece:
    width = float(rng.choice((1.0, 1.6, 1.9)))
    tables = [_box(0.5, 0.45, x=side * (width / 2 + 0.25)) for side in (-1, 1)]
    return _at_wall(_box(width, rng.uniform(2.0, 2.2)), *tables[: int(rng.integers(0, 3))])


def _desk(rng: Generator) -> Piece:
    return _at_wall(
        _box(rng.uniform(1.2, 1.8), 0.75), _box(0.5, 0.5, x=rng.uniform(-0.3, 0.3), y=0.6)
    )


def _sofa(rng: Generator) -> Piece:
    length = rng.uniform(1.7, 2.8)
    parts = [_box(length, 0.95)]
    if rng.random() < 0.35:
        parts.append(_box(0.95, 1.7, x=float(rng.choice((-1.0, 1.0))) * (length - 0.95) / 2))
    if rng.random() < 0.6:
        parts.append(_box(rng.uniform(0.7, 1.3), 0.6, y=1.45))
    return _at_wall(*parts)


def _bathtub(rng: Generator) -> Piece:
    return _at_wall(_box(1.7, 0.75) if rng.random() < 0.6 else _box(0.9, 0.9))


def _basin(rng: Generator) -> Piece:
    return _at_wall(_box(rng.uniform(0.4, 1.2), rng.uniform(0.45, 0.7)))


def _island(rng: Generator) -> Piece:
    part = Part(x=0.0, y=0.0, length=rng.uniform(1.4, 2.4), depth=rng.uniform(0.8, 1.1))
    return Piece(parts=(part,), at_wall=False)


def _seats(rng: Generator) -> Piece:
    """A sofa with armchairs around a low table."""
    parts = [
        Part(x=0.0, y=0.0, length=rng.uniform(0.8, 1.3), depth=0.7, is_round=rng.random() < 0.4),
        Part(x=0.0, y=-1.25, length=rng.uniform(1.6, 2.4), depth=0.9),
    ]
    for side in (-1, 1)[: int(rng.integers(0, 3))]:
        parts.append(Part(x=side * 1.5, y=rng.uniform(-0.4, 0.4), length=0.85, depth=0.85))
    return Piece(parts=tuple(parts), at_wall=False)


def _armchair(rng: Generator) -> Piece:
    side, is_round = rng.uniform(0.4, 0.95), rng.random() < 0.5
    part = Part(x=0.0, y=0.0, length=side, depth=side, is_round=is_round)
    return Piece(parts=(part,), at_wall=False)


def _dining(rng: Generator) -> Piece:
    """A table with chairs, half under it."""
    if rng.random() < 0.3:
        return _round_table(rng)
    length, depth = rng.uniform(1.3, 2.6), rng.uniform(0.8, 1.1)
    places = max(1, int(length / 0.7))
    chairs = [
        ((place - (places - 1) / 2) * length / places, side * (depth / 2 + 0.1))
        for place in range(places)
        for side in (-1, 1)
    ]
    chairs += [(side * (length / 2 + 0.1), 0.0) for side in (-1, 1) if rng.random() < 0.5]
    table = Part(x=0.0, y=0.0, length=length, depth=depth)
    stands = _legs(table) if rng.random() < _LEGS_SHARE else [table]
    stands += [Part(x=x, y=y, length=_CHAIR_M, depth=_CHAIR_M) for x, y in chairs]
    return Piece(parts=tuple(stands), at_wall=False)


def _round_table(rng: Generator) -> Piece:
    size, chairs = rng.uniform(0.9, 1.5), int(rng.integers(3, 6))
    angles = 2 * np.pi * np.arange(chairs) / chairs
    parts = [Part(x=0.0, y=0.0, length=size, depth=size, is_round=True)]
    for x, y in zip(np.cos(angles).tolist(), np.sin(angles).tolist(), strict=True):
        reach = size / 2 + 0.1
        parts.append(Part(x=reach * x, y=reach * y, length=_CHAIR_M, depth=_CHAIR_M, is_round=True))
    return Piece(parts=tuple(parts), at_wall=False)


def _legs(stand: Part) -> list[Part]:
    """What is left of a table near the floor."""
    return [
        Part(
            x=stand.x + side * (stand.length - _LEG_M) / 2,
            y=stand.y + end * (stand.depth - _LEG_M) / 2,
            length=_LEG_M,
            depth=_LEG_M,
        )
        for side in (-1, 1)
        for end in (-1, 1)
    ]


_Maker = Callable[[Generator], Piece]
_SMALL_ROOMS: tuple[tuple[_Maker, ...], ...] = (
    (_bed, _cupboard, _desk),
    (_bed, _cupboard, _cupboard),
    (_desk, _cupboard, _cupboard),
    (_counter, _dining),
    (_bathtub, _basin, _cupboard, _cupboard),
)
_LARGE_ROOMS: tuple[tuple[_Maker, ...], ...] = (
    (_seats, _sofa, _cupboard, _cupboard, _armchair),
    (_sofa, _dining, _cupboard, _cupboard),
    (_dining, _cupboard, _cupboard, _cupboard),
    (_counter, _island, _dining, _cupboard),
    (_bed, _sofa, _cupboard, _desk, _cupboard),
)
_FILLERS: tuple[_Maker, ...] = (
    _cupboard,
    _cupboard,
    _cupboard,
    _clutter,
    _sofa,
    _bed,
    _desk,
)
