"""Places as `.npz`: cells, what was observed, resolution, origin, start and goal; no pickle.

`cells` and `observed` are (H, W) and lie like `nav_msgs/OccupancyGrid`: row 0 is the lowest y, and
`origin` [m] the lower left corner. `start` [m, m, rad] and `goal` [m] are NaN where not fixed.
"""

import io
import lzma
import zipfile
import zlib
from pathlib import Path

import numpy as np

from ses_core.errors import NotAMapError, WorldError
from ses_core.geometry import Pose2D
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.place import Place
from ses_core.worlds.grids import MOST_CELLS
from ses_core.worlds.identity import named_world
from storage.world_files import first_line

ARRAY_SUFFIX = ".npz"

_SHAPES = {"resolution": (), "origin": (2,), "start": (3,), "goal": (2,)}

_UNREADABLE = (
    OSError,
    ValueError,
    KeyError,
    EOFError,
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    # Raised for an encrypted entry; for an unknown compression, its subclass NotImplementedError.
    RuntimeError,
    # Raised for a header that claims more than there is.
    MemoryError,
)


def array_world(place: Place) -> bytes:
    """Give a place as the bytes of an `.npz`; equal places give equal bytes."""
    start, goal = place.start, place.goal
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer,
        cells=place.grid.cells,
        observed=place.observed,
        resolution=np.float64(place.grid.resolution),
        origin=np.asarray(place.grid.origin, dtype=np.float64),
        start=np.full(3, np.nan) if start is None else np.array([start.x, start.y, start.yaw]),
        goal=np.full(2, np.nan) if goal is None else np.asarray(goal, dtype=np.float64),
        identity=np.asarray(place.identity),
    )
    return buffer.getvalue()


def read_array_world(path: Path) -> World:
    """Read the world that `array_world` wrote; what was not observed counts as the cells say.

    Raises:
        NotAMapError: It holds other arrays.
        WorldError: It is no such file, or larger than any world.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            # Two arrays of a byte per cell, and a few numbers.
            if sum(entry.file_size for entry in archive.infolist()) > 2 * MOST_CELLS + 2**20:
                raise WorldError(f"{path} unpacks to more than {MOST_CELLS} cells")
        with np.load(path, allow_pickle=False) as arrays:
            if missing := {"cells", *_SHAPES} - set(arrays.files):
                raise NotAMapError(
                    f"{path} has no {', '.join(sorted(missing))}, expected the arrays of a world "
                    "that `ses export` wrote"
                )
            cells = arrays["cells"]
            numbers = {name: np.asarray(arrays[name], dtype=np.float64) for name in _SHAPES}
    except _UNREADABLE as error:
        raise WorldError(f"{path} cannot be read as a world: {first_line(error)}") from error
    if cells.ndim != 2 or cells.dtype != np.bool_ or not 0 < cells.size <= MOST_CELLS:
        raise WorldError(
            f"{path} has cells of type {cells.dtype} and shape {cells.shape}, "
            f"expected truth values (H, W), at most {MOST_CELLS}"
        )
    for name, shape in _SHAPES.items():
        if numbers[name].shape != shape:
            raise WorldError(f"{path} has {name} of shape {numbers[name].shape}, expected {shape}")
    resolution, origin = float(numbers["resolution"]), numbers["origin"]
    if not (0.0 < resolution < np.inf and np.isfinite(origin).all()):
        raise WorldError(
            f"{path} has resolution {resolution} and origin {origin.tolist()}, expected more than "
            "0 m and two numbers"
        )
    (x, y), start, goal = origin.tolist(), numbers["start"], numbers["goal"]
    course = None
    if np.isfinite(start).all() and np.isfinite(goal).all():
        course = (Pose2D(*start.tolist()), (float(goal[0]), float(goal[1])))
    grid = OccupancyGrid(cells=cells, resolution=resolution, origin=(x, y))
    return named_world(path.stem, grid, source="npz", course=course)
