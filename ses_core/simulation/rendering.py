"""From a grid to a three-dimensional world: merged boxes in one concave mesh.

One mesh is by far the cheapest form for a physics engine: a box per occupied cell steps an
order of magnitude slower. Each box is watertight on its own; the ring of wall around the map
that `World` speaks of is built too.
"""

from dataclasses import dataclass

import numpy as np

from ses_core.arrays import BoolArray, FloatArray, IntArray
from ses_core.compilation import compiled
from ses_core.occupancy import OccupancyGrid

WALL_HEIGHT_M = 1.0
"""Height of everything [m]; above the laser of every robot we know, as in BARN."""

_CORNERS = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
)
_BOX_FACES = np.array(
    [
        *((0, 2, 1), (0, 3, 2)),  # bottom
        *((4, 5, 6), (4, 6, 7)),  # top
        *((0, 1, 5), (0, 5, 4)),  # front
        *((1, 2, 6), (1, 6, 5)),  # right
        *((2, 3, 7), (2, 7, 6)),  # back
        *((3, 0, 4), (3, 4, 7)),  # left
    ]
)
"""Corners of the 12 triangles, counter-clockwise from outside."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderedWorld:
    """A world as solid geometry.

    Attributes:
        boxes: (B, 4) [m] x_min, y_min, x_max, y_max of boxes standing on the ground.
        vertices: (8 B, 3) [m].
        faces: (12 B, 3) indices of vertices, counter-clockwise from outside.
    """

    boxes: FloatArray
    vertices: FloatArray
    faces: IntArray


def render(grid: OccupancyGrid) -> RenderedWorld:
    """Build the mesh of a map and of the wall around it; equal maps give equal meshes."""
    cells = np.pad(grid.cells, 1, constant_values=True)
    bounds = merge_boxes(cells)
    origin = np.asarray(grid.origin) - grid.resolution
    boxes = np.tile(origin, 2) + grid.resolution * bounds[:, [1, 0, 3, 2]]
    low = np.column_stack((boxes[:, :2], np.zeros(len(boxes))))
    high = np.column_stack((boxes[:, 2:], np.full(len(boxes), WALL_HEIGHT_M)))
    vertices = low[:, None] + _CORNERS * (high - low)[:, None]
    faces = _BOX_FACES + 8 * np.arange(len(boxes))[:, None, None]
    return RenderedWorld(
        boxes=boxes, vertices=vertices.reshape(-1, 3), faces=faces.reshape(-1, 3).astype(np.int64)
    )


def merge_boxes(cells: BoolArray) -> IntArray:
    """Cover the occupied cells (H, W) once by rectangles (B, 4): rows and columns [low, high).

    Greedy: from the first cell not yet covered as far along its row as possible, then as many
    rows further as are occupied over that whole length.
    """
    boxes = np.empty((np.count_nonzero(cells), 4), dtype=np.int64)
    return boxes[: _merge(cells.copy(), boxes)].copy()


@compiled
def _merge(waiting: BoolArray, boxes: IntArray) -> int:
    """Fill `boxes` and give their number; what is covered waits no longer."""
    height, width = waiting.shape
    count = 0
    for row in range(height):
        for column in range(width):
            if not waiting[row, column]:
                continue
            right = column + 1
            while right < width and waiting[row, right]:
                right += 1
            top = row + 1
            while top < height:
                is_full = True
                for k in range(column, right):
                    is_full = is_full and waiting[top, k]
                if not is_full:
                    break
                top += 1
            for covered in range(row, top):
                for k in range(column, right):
                    waiting[covered, k] = False
            boxes[count, 0], boxes[count, 1] = row, column
            boxes[count, 2], boxes[count, 3] = top, right
            count += 1
    return count


def obj_text(rendered: RenderedWorld, *, name: str) -> str:
    """Write a mesh as Wavefront OBJ, in millimetre precision."""
    lines = [f"o {name}"]
    lines += [f"v {x:.3f} {y:.3f} {z:.3f}" for x, y, z in rendered.vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (rendered.faces + 1).tolist()]
    return "\n".join(lines) + "\n"
