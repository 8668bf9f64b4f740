from collections import Counter

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from ses_core.arrays import BoolArray
from ses_core.occupancy import OccupancyGrid, from_drawing
from ses_core.simulation.rendering import merge_boxes, obj_text, render

CELLS = arrays.arrays(np.bool_, arrays.array_shapes(min_dims=2, max_dims=2, max_side=12))


@settings(deadline=None)
@given(CELLS)
def test_boxes_cover_every_occupied_cell_once_and_nothing_else(cells: BoolArray) -> None:
    covered = np.zeros(cells.shape, dtype=np.int64)
    for bottom, left, top, right in merge_boxes(cells):
        covered[bottom:top, left:right] += 1
    assert np.array_equal(covered, cells.astype(np.int64))


def test_a_wall_becomes_one_box() -> None:
    cells = from_drawing(
        """
        ......
        .####.
        .####.
        ......
        """
    )
    assert merge_boxes(cells).tolist() == [[1, 1, 3, 5]]


@settings(deadline=None)
@given(CELLS, st.floats(0.05, 0.5))
def test_every_box_is_watertight_and_faces_outwards(cells: BoolArray, resolution: float) -> None:
    world = render(OccupancyGrid(cells=cells, resolution=resolution, origin=(-1.0, 2.0)))
    edges = Counter(
        (int(a), int(b))
        for face in world.faces
        for a, b in zip(face, np.roll(face, -1), strict=True)
    )
    assert all(count == 1 and edges[b, a] == 1 for (a, b), count in edges.items())
    corners = world.vertices[world.faces]
    volume = np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    area = (np.pad(cells, 1, constant_values=True).sum()) * resolution**2
    assert np.isclose(volume, area * 1.0)


def test_the_mesh_stands_where_the_map_says() -> None:
    cells = np.zeros((2, 3), dtype=np.bool_)
    cells[1, 2] = True
    world = render(OccupancyGrid(cells=cells, resolution=0.5, origin=(10.0, -4.0)))
    # The one occupied cell merges with the ring around the map, which reaches half a metre out.
    assert world.boxes[:, :2].min(axis=0).tolist() == [9.5, -4.5]
    assert world.boxes[:, 2:].max(axis=0).tolist() == [12.0, -2.5]
    inside = [
        bool(np.any(np.all((world.boxes[:, :2] < point) & (world.boxes[:, 2:] > point), axis=1)))
        for point in ((11.25, -3.25), (10.75, -3.25), (10.25, -3.75))
    ]
    assert inside == [True, False, False]


def test_obj_counts_from_one_and_reads_back() -> None:
    world = render(OccupancyGrid(cells=np.eye(3, dtype=np.bool_), resolution=0.25))
    lines = obj_text(world, name="diagonal").splitlines()
    vertices = [tuple(map(float, line.split()[1:])) for line in lines if line.startswith("v ")]
    faces = [tuple(map(int, line.split()[1:])) for line in lines if line.startswith("f ")]
    assert np.allclose(vertices, world.vertices)
    assert np.array_equal(np.array(faces) - 1, world.faces)
