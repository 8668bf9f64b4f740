"""What each environment is like, in numbers: filling, speckle, path and difficulty."""

from collections.abc import Callable

import numpy as np
from scipy import ndimage

from ses_core.arrays import BoolArray, FloatArray
from ses_core.extraction.difficulty import measure_difficulty
from ses_core.occupancy import ENVIRONMENT_RESOLUTION_M, ENVIRONMENT_SIDE_M

SHAPE_MEASURES = {"occupancy": "share of cells", "components": "count", "perimeter": "m"}
"""Units of what can be measured in every environment."""

PATH_MEASURES = {
    "path length": "m",
    "closest obstacle": "m",
    "visibility": "m",
    "dispersion": "changes",
    "characteristic dimension": "m",
    "tortuosity": "ratio",
}
"""Units of what only an environment has that can be crossed."""

_TOUCHING = np.ones((3, 3), dtype=np.int64)


def occupancy(cells: BoolArray) -> FloatArray:
    """Give the share (N,) of occupied cells of environments (N, 30, 30)."""
    return cells.mean(axis=(1, 2), dtype=np.float64)


def components(cells: BoolArray) -> FloatArray:
    """Count the obstacles (N,); cells that touch at a corner belong together."""
    return np.array([float(ndimage.label(one, _TOUCHING)[1]) for one in cells], dtype=np.float64)


def perimeter(cells: BoolArray) -> FloatArray:
    """Give the length (N,) [m] of all sides between occupied and free cells."""
    across = (cells[:, :, 1:] != cells[:, :, :-1]).sum(axis=(1, 2))
    along = (cells[:, 1:] != cells[:, :-1]).sum(axis=(1, 2))
    return (across + along) * ENVIRONMENT_RESOLUTION_M


def shape_measures(cells: BoolArray) -> dict[str, FloatArray]:
    """Give the `SHAPE_MEASURES` (N,) of environments (N, 30, 30)."""
    return {
        "occupancy": occupancy(cells),
        "components": components(cells),
        "perimeter": perimeter(cells),
    }


def path_measures(
    cells: BoolArray, *, radius: float, progress: Callable[[float], None] = lambda _: None
) -> dict[str, FloatArray]:
    """Give the `PATH_MEASURES` (N,) for a disc of a radius [m]; nan where it cannot cross."""
    table = np.full((len(cells), len(PATH_MEASURES)), np.nan)
    for number, one in enumerate(cells):
        found = measure_difficulty(one, radius=radius)
        if found is not None:
            table[number] = (
                found.tortuosity * ENVIRONMENT_SIDE_M,
                found.closest_obstacle,
                found.visibility,
                found.dispersion,
                found.characteristic_dimension,
                found.tortuosity,
            )
        progress((number + 1) / len(cells))
    return dict(zip(PATH_MEASURES, table.T, strict=True))
