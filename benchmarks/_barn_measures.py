"""BARN's five difficulty measures of a field and a path, as its own code defines them.

In cells of the configuration space of a robot of 5 x 5 cells, averaged along the path
(jackal-map-creation, `DifficultyMetrics`; Perille et al. 2020, section IV). Three of its habits
are left out: Python 2's division to whole numbers, the start that counts twice, and two of the 16
rays that are out of turn.
"""

import math

import numpy as np
from scipy import ndimage

from ses_core.arrays import BoolArray, FloatArray, IntArray

MEASURES = (
    "closest obstacle",
    "visibility",
    "dispersion",
    "characteristic dimension",
    "tortuosity",
    "path length",
    "fill",
    "start row",
    "goal row",
)

_AXES = ((0, 1), (1, 1), (1, 0), (1, -1))
_EIGHT = _AXES + tuple((-down, -right) for down, right in _AXES)
_HALF = ((0, 1), (1, 2), (1, 1), (2, 1), (1, 0), (2, -1), (1, -1), (1, -2))
_SIXTEEN = _HALF + tuple((-down, -right) for down, right in _HALF)
"""In turning order. Rays with a 2 go two steps far, the others three, those with a -2 too."""

_DISPERSION_CELLS = 3


def texture(field: BoolArray) -> FloatArray:
    """Describe a field (30, 30) cell by cell: (18 + 36 + 1,) numbers.

    How many filled and empty cells have 0 to 8 filled neighbours, how full each of 36 blocks of
    5 x 5 cells is, and how many obstacles there are.
    """
    shown = hollowed(field).astype(np.int64)
    neighbours = ndimage.convolve(shown, np.ones((3, 3), dtype=np.int64), mode="constant") - shown
    counts = np.bincount((9 * shown + neighbours).ravel(), minlength=18)
    blocks = shown.reshape(6, 5, 6, 5).mean(axis=(1, 3)).ravel()
    _, obstacles = ndimage.label(shown)
    return np.concatenate((counts, blocks, (obstacles,))).astype(np.float64)


def hollowed(field: BoolArray) -> BoolArray:
    """Leave out cells whose eight neighbours are filled: BARN's files hold no cylinder there."""
    inner = ndimage.binary_erosion(field, structure=np.ones((3, 3), dtype=np.bool_))
    return field & ~inner


def barn_measures(field: BoolArray, path: IntArray) -> FloatArray:
    """Give `MEASURES` (9,) of a field (30, 30) and its path (K, 2), start named once."""
    blocked = ndimage.binary_dilation(field, structure=np.ones((5, 5), dtype=np.bool_))
    distance = ndimage.distance_transform_edt(~blocked)
    steps = np.hypot(*np.diff(path, axis=0).T).sum()
    return np.array(
        (
            distance[path[:, 0], path[:, 1]].mean(),
            *_look_around(blocked, path),
            steps / math.dist(path[0], path[-1]),
            steps,
            hollowed(field).mean(),
            path[0, 0],
            path[-1, 0],
        )
    )


def _look_around(blocked: BoolArray, path: IntArray) -> tuple[float, float, float]:
    """Visibility, dispersion and characteristic dimension, averaged along a path (K, 2)."""
    runs = {ray: _free_runs(blocked, path, ray, len(blocked)) for ray in _EIGHT}
    lengths = np.array([length for length, _ in runs.values()])
    is_seen = np.array([ends_blocked for _, ends_blocked in runs.values()])
    seen = np.where(is_seen, lengths + 1, 0).sum(axis=0) / is_seen.sum(axis=0).clip(min=1)
    widths = [(runs[ray][0] + runs[-ray[0], -ray[1]][0]) * math.hypot(*ray) for ray in _AXES]
    walls = np.array(
        [
            _free_runs(blocked, path, ray, 2 if 2 in ray else _DISPERSION_CELLS)[1]
            for ray in _SIXTEEN
        ]
    )
    changes = (walls != np.roll(walls, 1, axis=0)).sum(axis=0)
    return float(seen.mean()), float(changes.mean()), float(np.min(widths, axis=0).mean())


def _free_runs(
    blocked: BoolArray, path: IntArray, ray: tuple[int, int], most: int
) -> tuple[IntArray, BoolArray]:
    """Count free cells along a ray (K,), and tell if a blocked one ends it within `most` steps."""
    length = np.zeros(len(path), dtype=np.int64)
    is_going = np.ones(len(path), dtype=np.bool_)
    ends_blocked = np.zeros(len(path), dtype=np.bool_)
    padded = np.pad(blocked, 1)
    for step in range(1, most + 1):
        cells = path + step * np.array(ray)
        is_going &= ((cells >= 0) & (cells < blocked.shape)).all(axis=1)
        row, column = (np.where(is_going[:, None], cells, -1) + 1).T
        ends_blocked |= padded[row, column]
        is_going &= ~padded[row, column]
        length += is_going
    return length, ends_blocked
