"""Where the grids of a batch lie: true worlds shared by slots, and each slot's own map."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from ses_core.arrays import BoolArray, ByteArray
from ses_core.occupancy import OccupancyGrid, cell_centres, cell_indices, occupied_at
from ses_core.planning.costmap import FAR, MARGIN_M, RESOLUTION_M
from ses_core.simulation.lidar import chessboard_clearance

_IDLE_BYTES = 64 * 2**20


@dataclass(frozen=True, slots=True, kw_only=True)
class PooledWorld:
    """A world's clearance grid; `source` keeps the cells alive, so their id stays theirs."""

    source: BoolArray
    clearance: ByteArray


@dataclass(slots=True)
class WorldPool:
    """The clearance grids of the worlds in use, end to end; many slots may share one."""

    flat: ByteArray = field(default_factory=lambda: np.zeros(0, dtype=np.uint8))
    offsets: dict[int, int] = field(default_factory=dict)
    worlds: dict[int, PooledWorld] = field(default_factory=dict)

    def hold(self, grids: list[OccupancyGrid], kept: set[int]) -> None:
        """Make room for the grids; beyond 64 MiB those go that neither they nor `kept` name."""
        needed = kept | {id(grid.cells) for grid in grids}
        if all(id(grid.cells) in self.worlds for grid in grids):
            return
        if self.flat.size > _IDLE_BYTES:
            for key in self.worlds.keys() - needed:
                del self.worlds[key]
        for grid in grids:
            if id(grid.cells) not in self.worlds:
                # One occupied cell all round: beyond the map is a wall.
                walled = np.pad(grid.cells, 1, constant_values=True)
                self.worlds[id(grid.cells)] = PooledWorld(
                    source=grid.cells, clearance=chessboard_clearance(walled)
                )
        self.flat = np.concatenate([world.clearance.ravel() for world in self.worlds.values()])
        sizes = [world.clearance.size for world in self.worlds.values()]
        starts = np.concatenate(([0], np.cumsum(sizes)[:-1]))
        self.offsets = dict(zip(self.worlds, (int(start) for start in starts), strict=True))


def describe_world(slot: NDArray[np.void], grid: OccupancyGrid) -> None:
    """Write a world's shape, and that of the map of what will be seen of it, into a slot."""
    height, width = grid.cells.shape
    slot["world_width"], slot["world_height"] = width + 2, height + 2
    slot["world_x"] = grid.origin[0] - grid.resolution
    slot["world_y"] = grid.origin[1] - grid.resolution
    slot["world_resolution"] = grid.resolution
    slot["map_x"], slot["map_y"] = grid.origin[0] - MARGIN_M, grid.origin[1] - MARGIN_M
    slot["map_width"] = int(np.ceil((grid.width_m + 2.0 * MARGIN_M) / RESOLUTION_M))
    slot["map_height"] = int(np.ceil((grid.height_m + 2.0 * MARGIN_M) / RESOLUTION_M))


def known_map(slot: NDArray[np.void], grid: OccupancyGrid) -> tuple[ByteArray, ByteArray]:
    """Give marks and squared distances (H, W) [cells^2] of a map that is known beforehand.

    A cell of the robot's map is marked where its centre is occupied, or where the centre of an
    occupied cell of the world lies in it.
    """
    shape = int(slot["map_height"]), int(slot["map_width"])
    origin = (float(slot["map_x"]), float(slot["map_y"]))
    blank = OccupancyGrid(
        cells=np.zeros(shape, dtype=np.bool_), resolution=RESOLUTION_M, origin=origin
    )
    rows, columns = np.indices(shape)
    centres = cell_centres(blank, np.column_stack((columns.ravel(), rows.ravel())))
    marks = occupied_at(grid, centres, outside=False).reshape(shape)
    occupied_rows, occupied_columns = np.nonzero(grid.cells)
    walls = cell_indices(
        blank, cell_centres(grid, np.column_stack((occupied_columns, occupied_rows)))
    )
    marks[walls[:, 1], walls[:, 0]] = True
    squared = np.full(shape, FAR, dtype=np.float64)
    if marks.any():
        squared = np.rint(distance_transform_edt(~marks) ** 2)
    return marks.astype(np.uint8), np.minimum(squared, FAR).astype(np.uint8)
