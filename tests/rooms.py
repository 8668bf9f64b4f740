"""A room as triangles: four walls, a doorway, a table, and a yard before the door."""

import numpy as np

from ses_core.arrays import Float32Array

Point = tuple[float, float, float]

ROOM_DRAWN = """
################
#..............#
#..............#
#..............#
#..............#
######....######
#..............#
#..............#
#..............#
#......####....#
#......####....#
#......####....#
#..............#
#..............#
################
"""
"""Its map in cells of 0.25 m, y up."""


def box(low: Point, high: Point) -> Float32Array:
    """Give a box's triangles (12, 3, 3), their normals outward."""
    corners = np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)])
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    faces = [face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))]
    return corners[np.array(faces)].astype(np.float32)


def room(*, floor: bool = True) -> list[Float32Array]:
    """Give the boxes: 3.5 x 2 m inside, walls of 0.25 m, a doorway of 1 m, a low table."""
    walls = [
        box((-0.25, -0.25, 0), (3.75, 0, 2)),
        box((-0.25, 0, 0), (0, 2, 2)),
        box((3.5, 0, 0), (3.75, 2, 2)),
        box((-0.25, 2, 0), (1.25, 2.25, 2)),
        box((2.25, 2, 0), (3.75, 2.25, 2)),
        # The lintel, higher than any robot of ours.
        box((1.25, 2, 1.9), (2.25, 2.25, 2)),
        box((-0.25, 2.25, 0), (0, 3.25, 1)),
        box((3.5, 2.25, 0), (3.75, 3.25, 1)),
        box((-0.25, 3.25, 0), (3.75, 3.5, 1)),
    ]
    table = [
        box((1.5, 0.5, 0.4), (2.5, 1.25, 0.45)),
        box((1.5, 0.5, 0), (1.6, 0.6, 0.4)),
        box((2.4, 1.15, 0), (2.5, 1.25, 0.4)),
    ]
    ground = [box((-0.25, -0.25, -0.1), (3.75, 3.5, 0))]
    return [*walls, *table, *(ground if floor else [])]


FURNISHED_ROOM = np.concatenate(room())
