import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from ses_core.arrays import Float32Array
from ses_core.errors import WorldError
from ses_core.occupancy import OccupancyGrid, draw
from ses_core.worlds.cell_marking import mark_disc, mark_polygon, mark_slab
from ses_core.worlds.mesh_slicing import MeshSlicing, slice_mesh
from tests.rooms import FURNISHED_ROOM, ROOM_DRAWN, box, room

GROUND = box((0, 0, -0.1), (4, 4, 0))


def _slice(
    *boxes: Float32Array,
    low: float = 0.1,
    high: float = 0.5,
    floor: float | None = None,
    resolution: float = 0.1,
) -> OccupancyGrid:
    slicing = MeshSlicing(low=low, high=high, floor=floor)
    return slice_mesh(np.concatenate(boxes), slicing, up="z", resolution=resolution)


def test_a_room_with_a_table_and_a_doorway_slices_to_its_cells() -> None:
    grid = slice_mesh(FURNISHED_ROOM, MeshSlicing(), up="z", resolution=0.25)
    assert draw(grid.cells[::-1]).splitlines() == ROOM_DRAWN.split()
    assert grid.origin == (-0.25, -0.25)


def test_a_table_top_counts_only_where_the_slice_reaches_it() -> None:
    top = box((1, 1, 0.70), (2, 2, 0.75))
    under, over = _slice(GROUND, top), _slice(GROUND, top, high=0.8)
    assert not under.cells.any()
    assert np.count_nonzero(over.cells) == 100
    assert over.cells[10:20, 10:20].all()


def test_a_sill_lower_than_the_slice_is_driven_over() -> None:
    sill = box((2, 0, 0), (2.2, 4, 0.08))
    assert not _slice(GROUND, sill).cells.any()
    assert _slice(GROUND, sill, low=0.02).cells.any()


def test_the_inside_of_solids_is_no_ground() -> None:
    # Only its faces are in the mesh; the floor goes on below it.
    cupboard = box((1, 1, 0), (2, 2, 1.8))
    assert np.count_nonzero(_slice(GROUND, cupboard).cells) == 100


def test_ground_is_where_there_is_floor() -> None:
    elsewhere = box((5, 0, -0.1), (9, 4, 0))
    cells = _slice(GROUND, elsewhere).cells
    assert cells[:, 41:49].all()
    assert not cells[:, :40].any()


def test_the_lowest_storey_is_sliced_unless_another_is_asked_for() -> None:
    upstairs = box((0, 0, 2.5), (4, 4, 2.6))
    chest = box((1, 1, 2.6), (2, 2, 3.2))
    assert not _slice(GROUND, upstairs, chest).cells.any()
    assert np.count_nonzero(_slice(GROUND, upstairs, chest, floor=2.6).cells) == 100


def test_axes_that_point_up_give_the_same_map() -> None:
    expected = slice_mesh(FURNISHED_ROOM, MeshSlicing(), up="z", resolution=0.25)
    as_y = FURNISHED_ROOM[:, :, [0, 2, 1]] * np.array([1, 1, -1], dtype=np.float32)
    as_x = FURNISHED_ROOM[:, :, [2, 0, 1]]
    for triangles, up in ((as_y, "y"), (as_x, "x")):
        grid = slice_mesh(triangles, MeshSlicing(), up=up, resolution=0.25)  # type: ignore[arg-type]  # a literal in a loop
        assert np.array_equal(grid.cells, expected.cells)


def test_walls_without_a_floor_stand_on_the_ground_around_them() -> None:
    cells = _slice(*room(floor=False), resolution=0.25).cells
    assert 0 < np.count_nonzero(~cells) < cells.size


@pytest.mark.parametrize("height", [0.0, 2.6, 77.7])
def test_a_slice_from_the_floor_itself_has_ground(height: float) -> None:
    raised = np.array((0, 0, height), dtype=np.float32)
    chest = box((1, 1, 0), (2, 2, 0.6))
    post = box((4.5, 0, 0), (5, 4, 1))
    cells = _slice(GROUND + raised, chest + raised, post + raised, low=0.0).cells
    # The ground goes as far as the floor does: to what is cut off beyond it, one cell is kept.
    assert cells.shape == (40, 41)
    assert np.count_nonzero(cells) == 100 + 40


def test_faces_wound_the_other_way_are_floor_too() -> None:
    sheet = GROUND[(GROUND[:, :, 2] == 0.0).all(axis=1)]
    chest = box((1, 1, 0), (2, 2, 0.6))
    expected = _slice(sheet, chest).cells
    assert np.count_nonzero(expected) == 100
    for tiles in (sheet[:, ::-1], np.concatenate((sheet[:1], sheet[1:, ::-1]))):
        assert np.array_equal(_slice(tiles, chest).cells, expected)


def test_what_is_no_building_is_refused() -> None:
    with pytest.raises(WorldError, match="is it in metres"):
        _slice(GROUND * 1000, resolution=0.05)
    with pytest.raises(WorldError, match="neither floor nor walls"):
        _slice(GROUND, floor=50.0)
    with pytest.raises(ValueError, match="the lower one first"):
        MeshSlicing(low=0.5, high=0.1)


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 10_000),
    resolution=st.sampled_from([0.05, 0.1, 0.3]),
)
def test_marked_cells_are_those_that_samples_of_the_part_in_the_slab_fall_into(
    seed: int, resolution: float
) -> None:
    rng = np.random.default_rng(seed)
    triangle = rng.uniform(0.2, 2.8, size=(1, 3, 3)).astype(np.float32)
    size = math.ceil(3 / resolution)
    cells = np.zeros((size, size), dtype=np.bool_)
    mark_slab(cells, triangle, low=0.8, high=2.0, origin=(0.0, 0.0), resolution=resolution)
    weights = rng.dirichlet((1, 1, 1), size=4000)
    points = weights @ triangle[0].astype(np.float64)
    points = points[(points[:, 2] > 0.8) & (points[:, 2] < 2.0), :2] / resolution
    # Nothing marked is farther from all samples than the samples lie apart.
    inside = np.abs(points - np.rint(points)).min(axis=1, initial=1.0) > 0.01
    hit = points[inside].astype(np.int64)
    assert cells[hit[:, 1], hit[:, 0]].all()
    bottom, top = triangle[0, :, 2].min(), triangle[0, :, 2].max()
    assert cells.any() == bool(top > 0.8 + 1e-5 and bottom < 2.0 - 1e-5)
    rows, columns = np.nonzero(cells)
    if len(points) > 1000:
        middles = np.column_stack((columns, rows)) + 0.5
        nearest, _ = KDTree(points).query(middles)
        assert np.max(nearest) < 0.75 + 0.15 / resolution


def test_shapes_that_end_on_cell_edges_cover_the_cells_between() -> None:
    cells = np.zeros((20, 20), dtype=np.bool_)
    corners = np.array([(0.5, 0.3), (1.0, 0.3), (1.0, 0.9), (0.5, 0.9)])
    mark_polygon(cells, corners, origin=(0.0, 0.0), resolution=0.1)
    assert np.count_nonzero(cells) == 30
    assert cells[3:9, 5:10].all()


def test_a_disc_touches_the_cells_it_reaches_into() -> None:
    cells = np.zeros((9, 9), dtype=np.bool_)
    mark_disc(cells, (4.5, 4.5), 1.0, origin=(0.0, 0.0), resolution=1.0)
    assert draw(cells[3:6, 3:6]) == "###\n###\n###"
    cells[:] = False
    mark_disc(cells, (4.5, 4.5), 0.5, origin=(0.0, 0.0), resolution=1.0)
    assert np.count_nonzero(cells) == 1
    cells[:] = False
    mark_disc(cells, (0.0, 4.2), 0.1, origin=(0.0, 0.0), resolution=1.0)
    assert np.argwhere(cells).tolist() == [[4, 0]]
