"""A mesh of a building to the map of one of its floors.

A cell is free where there is floor in it and nothing between the two heights of the slice.
The default slice is what the Jackal bumps into: from 0.1 m, the height of its wheels' hubs, over
door sills and the noise of scanned floors, up to 0.5 m, just over its laser. What hangs higher
(table tops at 0.7 m, sinks, lintels) it passes under; a taller robot needs a higher slice.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import ndimage

from ses_core.arrays import BoolArray, Float32Array, FloatArray
from ses_core.errors import WorldError
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.cell_marking import mark_slab
from ses_core.worlds.grids import MOST_CELLS, cut_to_free

UpAxis = Literal["auto", "x", "y", "z"]

_FLOOR_DEPTH_M = 0.2
"""A floor may lie this much deeper than its usual height: scanned floors are not level."""

_FLOOR_THICKNESS_M = 0.001
"""What is sliced from the floor itself starts this much above it, or the floor is in the way."""

_LEVEL = 0.9
"""Vertical part of the normal from which a face counts as level."""

_BIN_M = 0.05
_FLOOR_SHARE = 0.2
"""A height is a storey's floor from this share of the largest level surface."""

_POCKET_M2 = 2.0
_POCKET_WIDTH_M = 0.6
"""Free ground smaller or narrower than this is the inside of furniture and walls."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeshSlicing:
    """How a mesh becomes a map.

    Attributes:
        low: Height above the floor from which things are in the way [m].
        high: Height above which the robot passes under them [m].
        up: Axis that points up; `auto` takes what the file's format lays down.
        floor: Height of the floor along that axis [m]; else the lowest large level surface.
    """

    low: float = 0.1
    high: float = 0.5
    up: UpAxis = "auto"
    floor: float | None = None

    def __post_init__(self) -> None:
        if not (0.0 <= self.low < self.high < np.inf):
            raise ValueError(
                f"slice from {self.low:g} to {self.high:g} m above the floor, expected two "
                "heights, the lower one first"
            )


DEFAULT_SLICING = MeshSlicing()


def slice_mesh(
    triangles: Float32Array, slicing: MeshSlicing, *, up: Literal["x", "y", "z"], resolution: float
) -> OccupancyGrid:
    """Slice triangles (N, 3, 3) [m] into a map, seen from above.

    With y up, as in glTF, x stays x and -z becomes y; with x up, y and z become x and y.

    Raises:
        WorldError: There is nothing to slice, or the map would be too large.
    """
    upright = _upright(triangles, up)
    steepness, areas = _faces(upright)
    heights = upright[:, :, 2]
    floor = _floor(heights.mean(axis=1), steepness, areas) if slicing.floor is None else None
    base = slicing.floor if floor is None else floor
    assert base is not None
    bottom, top = heights.min(axis=1) - base, heights.max(axis=1) - base
    low = max(slicing.low, _FLOOR_THICKNESS_M)
    # Whichever way round its corners go: many files do not care.
    is_level = np.abs(steepness) > _LEVEL
    ground = upright[is_level & (top > -_FLOOR_DEPTH_M) & (bottom < low)]
    obstacles = upright[(top > low) & (bottom < slicing.high)]
    origin, shape = _frame([ground, obstacles], resolution)
    free = np.zeros(shape, dtype=np.bool_)
    if len(ground):
        mark_slab(
            free,
            ground,
            low=base - _FLOOR_DEPTH_M,
            high=base + low,
            origin=origin,
            resolution=resolution,
        )
    else:
        # Walls alone: the floor goes without saying.
        free[:] = True
    occupied = np.zeros(shape, dtype=np.bool_)
    mark_slab(
        occupied,
        obstacles,
        low=base + low,
        high=base + slicing.high,
        origin=origin,
        resolution=resolution,
    )
    cells = _without_pockets(~free | occupied, resolution)
    return cut_to_free(OccupancyGrid(cells=cells, resolution=resolution, origin=origin))


def _upright(triangles: Float32Array, up: Literal["x", "y", "z"]) -> Float32Array:
    if up == "z":
        return np.ascontiguousarray(triangles, dtype=np.float32)
    axes, signs = ([0, 2, 1], [1, -1, 1]) if up == "y" else ([1, 2, 0], [1, 1, 1])
    return np.ascontiguousarray(triangles[:, :, axes] * np.array(signs, dtype=np.float32))


def _faces(triangles: Float32Array) -> tuple[FloatArray, FloatArray]:
    """Give each face's vertical part of its unit normal (N,), and its area (N,) [m2]."""
    first = triangles[:, 0]
    normals = np.cross(triangles[:, 1] - first, triangles[:, 2] - first).astype(np.float64)
    lengths = np.linalg.norm(normals, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        steepness = np.where(lengths > 0.0, normals[:, 2] / lengths, 0.0)
    return steepness, lengths / 2.0


def _floor(heights: Float32Array, steepness: FloatArray, areas: FloatArray) -> float:
    """Find the lowest height at which a large level surface faces up; else the lowest point.

    Where hardly any faces up, the file has its floor wound the other way.
    """
    level, ceiling = steepness > _LEVEL, steepness < -_LEVEL
    if areas[level].sum() < _FLOOR_SHARE * areas[ceiling].sum():
        level = ceiling
    if not level.any():
        return float(heights.min())
    found, weights = heights[level].astype(np.float64), areas[level]
    lowest = float(found.min())
    if (float(found.max()) - lowest) / _BIN_M > MOST_CELLS:
        raise WorldError("mesh is higher than any building, expected metres")
    bins = np.bincount(((found - lowest) / _BIN_M).astype(np.int64), weights=weights)
    # A floor may lie on the border of two bins.
    together = bins + np.append(bins[1:], 0.0)
    chosen = int(np.flatnonzero(together >= _FLOOR_SHARE * together.max())[0])
    start = lowest + chosen * _BIN_M
    near = (found >= start) & (found < start + 2 * _BIN_M)
    return float(np.average(found[near], weights=weights[near]))


def _frame(
    parts: list[Float32Array], resolution: float
) -> tuple[tuple[float, float], tuple[int, int]]:
    """Give the origin [m] and shape of a grid around parts, its cells on whole multiples."""
    points = np.concatenate([part.reshape(-1, 3)[:, :2] for part in parts])
    if not len(points):
        raise WorldError("mesh has neither floor nor walls at that height, expected --floor")
    low = np.floor(points.min(axis=0).astype(np.float64) / resolution + 1e-3)
    high = np.ceil(points.max(axis=0).astype(np.float64) / resolution - 1e-3)
    width, height = (int(extent) for extent in np.maximum(high - low, 1.0))
    if width * height > MOST_CELLS:
        raise WorldError(
            f"mesh spans {width * resolution:.0f} x {height * resolution:.0f} m, expected at most "
            f"{MOST_CELLS} cells: is it in metres?"
        )
    return (float(low[0] * resolution), float(low[1] * resolution)), (height, width)


def _without_pockets(cells: BoolArray, resolution: float) -> BoolArray:
    """Fill free ground that no robot fits into: what solids have inside, cracks in scans."""
    labels, count = ndimage.label(~cells)
    if count == 0:
        return cells
    sizes = np.bincount(labels.ravel())
    depth = ndimage.distance_transform_edt(np.pad(~cells, 1))[1:-1, 1:-1]
    widest = ndimage.maximum(depth, labels, index=np.arange(count + 1))
    is_pocket = (sizes * resolution**2 < _POCKET_M2) | (
        2.0 * np.asarray(widest) * resolution < _POCKET_WIDTH_M
    )
    is_pocket[0] = False
    # A map of small pockets alone is a small map.
    if is_pocket[1:].all():
        return cells
    return np.asarray(cells | is_pocket[labels])
