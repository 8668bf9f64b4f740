"""Where the grids of a batch lie."""

import numpy as np
import pytest

from ses_core.occupancy import OccupancyGrid
from ses_core.simulation import world_pool
from ses_core.simulation.lidar import chessboard_clearance
from ses_core.simulation.state import SLOT_DTYPE
from ses_core.simulation.world_pool import WorldPool, describe_world


def _grid(size: int) -> OccupancyGrid:
    return OccupancyGrid(
        cells=np.zeros((size, size + 1), dtype=np.bool_), resolution=0.1, origin=(2.0, -1.0)
    )


def test_each_world_lies_at_its_offset_with_a_wall_around_it() -> None:
    pool, grids = WorldPool(), [_grid(3), _grid(5)]
    pool.hold(grids, set())
    for grid in grids:
        walled = np.pad(grid.cells, 1, constant_values=True)
        first = pool.offsets[id(grid.cells)]
        np.testing.assert_array_equal(
            pool.flat[first : first + walled.size], chessboard_clearance(walled).ravel()
        )


def test_a_world_that_is_there_is_not_laid_down_twice() -> None:
    pool, grid = WorldPool(), _grid(4)
    pool.hold([grid, grid], set())
    flat = pool.flat
    pool.hold([grid], set())
    assert pool.flat is flat
    assert pool.flat.size == 6 * 7


def test_idle_worlds_go_once_there_are_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    pool, kept, idle, new = WorldPool(), _grid(3), _grid(4), _grid(5)
    pool.hold([kept, idle], set())
    monkeypatch.setattr(world_pool, "_IDLE_BYTES", 10)
    pool.hold([new], {id(kept.cells)})
    assert pool.offsets.keys() == {id(kept.cells), id(new.cells)}


def test_the_map_reaches_half_a_metre_beyond_the_world() -> None:
    slot = np.zeros(1, dtype=SLOT_DTYPE)[0]
    describe_world(slot, _grid(30))
    assert (slot["map_x"], slot["map_y"]) == (1.5, -1.5)
    assert (slot["map_width"], slot["map_height"]) == (82, 80)
    assert (slot["world_width"], slot["world_height"]) == (33, 32)
    np.testing.assert_allclose((slot["world_x"], slot["world_y"]), (1.9, -1.1))
