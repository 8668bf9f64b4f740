"""Gazebo `.world` files, BARN's among them: their solids as seen from above."""

import math
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.errors import NotAMapError, WorldError
from ses_core.geometry import Pose2D, compose
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.cell_marking import mark_disc, mark_polygon
from ses_core.worlds.cellular_automata import (
    CELL_M,
    COURSE_GOAL,
    COURSE_ORIGIN,
    COURSE_SHAPE,
    COURSE_START,
)
from ses_core.worlds.grids import MOST_CELLS
from ses_core.worlds.identity import named_world
from ses_core.worlds.mesh_slicing import DEFAULT_SLICING, MeshSlicing
from storage.gazebo_marks import declared_course, declared_floor, is_marked, sdf_numbers
from storage.sdf_tree import sdf_tree
from storage.world_files import read_text

GAZEBO_SUFFIXES = frozenset({".world", ".sdf"})

RESOLUTION_M = 0.05
"""Cells of a world made of solids, unless asked for others."""

_UPRIGHT_RAD = 0.05
"""Worlds saved from a running simulation lean by less."""

_NEEDLESS = frozenset({"state", "inertial"})
"""What of a world nobody bumps into, and most of a saved one."""

_SCENERY = frozenset({"ground_plane", "sun"})
"""Models included everywhere that nobody bumps into."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Solid:
    """A solid seen from above: a disc of a radius, or a box of half sizes, at a pose."""

    pose: Pose2D
    radius: float
    half_sizes: tuple[float, float]

    def corners(self) -> FloatArray:
        """Give the corners (4, 2) [m] of a box, or of the square around a disc."""
        if self.radius:
            half_x = half_y = self.radius
            yaw = 0.0
        else:
            (half_x, half_y), yaw = self.half_sizes, self.pose.yaw
        signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        cosine, sine = math.cos(yaw), math.sin(yaw)
        turned = (signs * (half_x, half_y)) @ np.array([(cosine, sine), (-sine, cosine)])
        return turned + np.array((self.pose.x, self.pose.y))


@dataclass(frozen=True, slots=True)
class _Placed:
    """A frame of the file: its pose seen from above, and its height [m]."""

    pose: Pose2D
    z: float


def read_gazebo_world(
    path: Path,
    *,
    text: str | None = None,
    resolution: float = RESOLUTION_M,
    slicing: MeshSlicing = DEFAULT_SLICING,
) -> World:
    """Read the cylinders, boxes and spheres of a Gazebo world as seen from above.

    Models are read where they are described, not again in `<state>`. What lies wholly below or
    above the slice, as a floor or a ceiling does, is left out. A world on BARN's lattice becomes
    BARN's course: its cells, start and goal, and open ground up to the goal. A world of our own
    writing gives back the very cells it was written from.

    Args:
        path: Names the world, and is read unless there is `text`.
        text: What the file holds, where it lies in an archive.
        resolution: Edge of a cell [m], where the world is not BARN's.
        slicing: Heights over z = 0 between which a robot bumps into things.

    Raises:
        WorldError: It is no SDF, or needs other files or shapes, or has no obstacle.
    """
    text = read_text(path) if text is None else text
    needless = _NEEDLESS if is_marked(text) else _NEEDLESS | {"visual"}
    world = sdf_tree(text, path, without=needless).find("world")
    if world is None:
        raise NotAMapError(f"{path} has no <world>, expected SDF")
    _refuse_includes(world, path)
    reader = _Reader(path, slicing)
    solids = [solid for model in world.findall("model") for solid in reader.solids(model)]
    if (floor := declared_floor(world, path)) is not None:
        _mark(solids, floor)
        return named_world(path.stem, floor, source="sdf", course=declared_course(world, path))
    if not solids:
        raise WorldError(f"{path} has no cylinder or box, expected at least one obstacle")
    if _is_barn(solids):
        # Its cylinders touch: each is the cell it stands in.
        cells = np.zeros(COURSE_SHAPE, dtype=np.bool_)
        places = np.array([(solid.pose.x, solid.pose.y) for solid in solids])
        columns, rows = np.rint((places - COURSE_ORIGIN) / CELL_M - 0.5).astype(np.int64).T
        cells[rows, columns] = True
        grid = OccupancyGrid(cells=cells, resolution=CELL_M, origin=COURSE_ORIGIN)
        return named_world(path.stem, grid, source="barn", course=(COURSE_START, COURSE_GOAL))
    return named_world(path.stem, _rasterise(solids, resolution, path), source="sdf")


def _refuse_includes(world: ET.Element, path: Path) -> None:
    for include in world.findall("include"):
        uri = (include.findtext("uri") or "").strip()
        if uri.rpartition("/")[2] not in _SCENERY:
            raise WorldError(
                f"{path} includes {uri or 'a model'}, expected every model in the file itself: "
                "save the world from Gazebo to have them written out"
            )


def _is_barn(solids: list[_Solid]) -> bool:
    """Recognise BARN: cylinders of 0.075 m on its lattice, filling its course's width."""
    centres = np.array([(solid.pose.x, solid.pose.y) for solid in solids])
    lattice = (centres - COURSE_ORIGIN) / CELL_M - 0.5
    return (
        all(abs(solid.radius - CELL_M / 2) < 1e-3 for solid in solids)
        and bool(np.abs(lattice - np.rint(lattice)).max() < 1e-2)
        and bool(np.allclose(centres.min(axis=0), (-4.425, 0.075), atol=1e-3))
        and bool(np.allclose(centres.max(axis=0), (-0.075, 9.525), atol=1e-3))
    )


def _rasterise(solids: list[_Solid], resolution: float, path: Path) -> OccupancyGrid:
    """Mark every cell that a solid touches; cells lie on whole multiples of their size."""
    corners = np.concatenate([solid.corners() for solid in solids])
    low = np.floor(corners.min(axis=0) / resolution + 1e-3)
    high = np.ceil(corners.max(axis=0) / resolution - 1e-3)
    width, height = np.maximum(high - low, 1.0).tolist()
    if width * height > MOST_CELLS:
        raise WorldError(
            f"{path} spans {width * resolution:.0f} x {height * resolution:.0f} m, "
            f"expected at most {MOST_CELLS} cells"
        )
    cells = np.zeros((int(height), int(width)), dtype=np.bool_)
    origin = (float(low[0] * resolution), float(low[1] * resolution))
    grid = OccupancyGrid(cells=cells, resolution=resolution, origin=origin)
    _mark(solids, grid)
    return grid


def _mark(solids: list[_Solid], grid: OccupancyGrid) -> None:
    """Mark in an empty grid every cell that a solid touches."""
    cells, origin, resolution = grid.cells, grid.origin, grid.resolution
    for solid in solids:
        if solid.radius:
            centre = (solid.pose.x, solid.pose.y)
            mark_disc(cells, centre, solid.radius, origin=origin, resolution=resolution)
        else:
            mark_polygon(cells, solid.corners(), origin=origin, resolution=resolution)


@dataclass(frozen=True, slots=True)
class _Reader:
    """Reads the solids of models between the heights of a slice."""

    path: Path
    slicing: MeshSlicing

    def solids(self, model: ET.Element, parent: _Placed | None = None) -> list[_Solid]:
        """Collect a model's solids, and those of the models in it."""
        place = self._placed(model, parent or _Placed(Pose2D(0.0, 0.0), 0.0))
        found = [solid for inner in model.findall("model") for solid in self.solids(inner, place)]
        for link in model.findall("link"):
            base = self._placed(link, place)
            for collision in link.findall("collision"):
                solid = self._solid(collision, self._placed(collision, base), model)
                if solid is not None:
                    found.append(solid)
        return found

    def _solid(self, collision: ET.Element, place: _Placed, model: ET.Element) -> _Solid | None:
        radius, half_sizes = 0.0, (0.0, 0.0)
        geometry = collision.find("geometry")
        shapes = list(geometry) if geometry is not None else []
        kind = shapes[0].tag if shapes else "nothing"
        if kind == "plane":
            return None
        if kind == "box":
            x, y, z = sdf_numbers(shapes[0].findtext("size"), 3, self.path)
            half_sizes, half_height = (x / 2, y / 2), z / 2
        elif kind in ("cylinder", "sphere"):
            (radius,) = sdf_numbers(shapes[0].findtext("radius"), 1, self.path)
            half_height = radius
            if kind == "cylinder":
                half_height = sdf_numbers(shapes[0].findtext("length"), 1, self.path)[0] / 2
        else:
            raise WorldError(
                f"{self.path} has a {kind} in model {model.get('name')!r}, expected box, "
                "cylinder or sphere: export its mesh and import that"
            )
        if min(radius or 1.0, half_height, *(half_sizes if not radius else ())) <= 0.0:
            raise WorldError(
                f"{self.path} has a {kind} without size in model {model.get('name')!r}, "
                "expected sizes above 0 m"
            )
        below = place.z + half_height <= self.slicing.low
        above = place.z - half_height >= self.slicing.high
        return (
            None
            if below or above
            else _Solid(pose=place.pose, radius=radius, half_sizes=half_sizes)
        )

    def _placed(self, element: ET.Element, parent: _Placed) -> _Placed:
        """Read where an element stands."""
        text = element.findtext("pose")
        if text is None or not text.strip():
            return parent
        x, y, z, roll, pitch, yaw = sdf_numbers(text, 6, self.path)
        if max(abs(math.sin(roll)), abs(math.sin(pitch))) > _UPRIGHT_RAD:
            raise WorldError(
                f"{self.path} has {element.get('name')!r} tilted by {roll:g} and {pitch:g} rad, "
                "expected it upright"
            )
        return _Placed(compose(parent.pose, Pose2D(x, y, yaw)), parent.z + z)
