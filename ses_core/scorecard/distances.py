"""How far apart environments are: by their cells, and by how far from obstacles one is.

Distances are taken between *distinct* maps only, and samples are lists of indices into them.
So copies are at distance 0 exactly, and equal distances are equal floats: the comparisons of
`ses_core.scorecard.manifolds` meet ties in every binary map.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ses_core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from ses_core.occupancy import ENVIRONMENT_CELLS, ENVIRONMENT_RESOLUTION_M

CLEARANCE_CAP_M = 1.0
"""Beyond this distance [m] from the nearest obstacle a place counts as open."""

_AREA = ENVIRONMENT_CELLS**2

_BLOCK = 512
"""Rows of a distance matrix that are worked on at once."""


@dataclass(frozen=True, slots=True)
class DistinctMaps:
    """The different maps among many environments.

    Attributes:
        cells: (U, 30, 30), no two equal, in the order of their first appearance.
        index: (N,) which of them each environment is.
    """

    cells: BoolArray
    index: IntArray


def distinct_maps(cells: BoolArray) -> DistinctMaps:
    """Find the different maps among environments (N, 30, 30)."""
    number: dict[bytes, int] = {}
    index = np.array(
        [number.setdefault(np.packbits(one).tobytes(), len(number)) for one in cells],
        dtype=np.int64,
    )
    _, first = np.unique(index, return_index=True)
    return DistinctMaps(cells=cells[first], index=index)


def mirrored(cells: BoolArray) -> BoolArray:
    """Swap left and right of environments (N, 30, 30)."""
    return np.ascontiguousarray(cells[:, :, ::-1])


def differing_cells(first: BoolArray, second: BoolArray) -> Float32Array:
    """Count the cells (N, M) in which environments (N, 30, 30) and (M, 30, 30) differ."""
    one = first.reshape(len(first), _AREA).astype(np.float32)
    other = second.reshape(len(second), _AREA).astype(np.float32)
    # Sums of at most 900 ones: exact in single precision.
    return one.sum(axis=1)[:, None] + other.sum(axis=1)[None, :] - 2.0 * (one @ other.T)


def differing_cells_or_mirrored(first: BoolArray, second: BoolArray) -> Float32Array:
    """Count differing cells (N, M), of a place as it is or mirrored, whichever is nearer."""
    return np.minimum(differing_cells(first, second), differing_cells(mirrored(first), second))


def clearance_feature(cells: BoolArray) -> Float32Array:
    """Distance [m] from every cell's centre to the nearest occupied one's, capped: (N, 900).

    A wall that is shifted by a cell changes this little, and the cells a lot.
    """
    cells_away = np.full(cells.shape, np.inf)
    for number, one in enumerate(cells):
        if one.any():
            cells_away[number] = ndimage.distance_transform_edt(~one)
    capped = np.minimum(cells_away * ENVIRONMENT_RESOLUTION_M, CLEARANCE_CAP_M)
    return capped.reshape(len(cells), _AREA).astype(np.float32)


def euclidean(features: Float32Array) -> Float32Array:
    """Euclidean distances (U, U) between the rows of features (U, D); symmetric, 0 to itself."""
    squares = (features.astype(np.float64) ** 2).sum(axis=1)
    distances = np.empty((len(features), len(features)), dtype=np.float32)
    for first in range(0, len(features), _BLOCK):
        rows = slice(first, first + _BLOCK)
        inner = features[rows].astype(np.float64) @ features.T.astype(np.float64)
        squared = squares[rows, None] + squares[None, :] - 2.0 * inner
        distances[rows] = np.sqrt(np.maximum(squared, 0.0))
    distances = np.maximum(distances, distances.T)
    np.fill_diagonal(distances, 0.0)
    return distances


def nearest(
    cells: BoolArray,
    among: BoolArray,
    *,
    left_out: IntArray,
    groups: IntArray,
    mirrored_too: bool,
) -> FloatArray:
    """Count the cells (N,) in which each environment differs from the nearest of others.

    Args:
        cells: (N, 30, 30) environments.
        among: (M, 30, 30) others.
        left_out: (N,) the group of `among` that each one is not compared with; -1 for none.
        groups: (M,) the group of each of the others.
        mirrored_too: The others' mirror images count as well.

    Returns:
        (N,); inf where nothing is left to compare with.
    """
    measure = differing_cells_or_mirrored if mirrored_too else differing_cells
    found = np.full(len(cells), np.inf)
    if len(among) == 0:
        return found
    for first in range(0, len(cells), _BLOCK):
        rows = slice(first, first + _BLOCK)
        apart = measure(cells[rows], among)
        apart[left_out[rows, None] == groups[None, :]] = np.inf
        found[rows] = apart.min(axis=1)
    return found
