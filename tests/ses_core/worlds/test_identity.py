from dataclasses import replace

import numpy as np

from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.identity import content_digest, named_world

GRID = OccupancyGrid(cells=np.eye(4, dtype=np.bool_), resolution=0.1)


def test_equal_content_keeps_its_digits_under_another_name() -> None:
    first = named_world("a", GRID, source="test")
    second = named_world("b", replace(GRID, cells=GRID.cells.copy()), source="test")
    assert first.world_id.removeprefix("a-") == second.world_id.removeprefix("b-")


def test_cells_shape_resolution_and_origin_all_count() -> None:
    others = [
        replace(GRID, cells=~GRID.cells),
        replace(GRID, cells=GRID.cells.reshape(2, 8)),
        replace(GRID, resolution=0.2),
        replace(GRID, origin=(0.0, 1.0)),
    ]
    assert len({content_digest(grid) for grid in (GRID, *others)}) == 5
