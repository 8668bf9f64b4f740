"""Gazebo `.world` files, BARN's among them: their solids as seen from above."""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from ses_core.arrays import BoolArray, FloatArray
from ses_core.errors import WorldError
from ses_core.geometry import Pose2D, compose
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.cellular_automata import (
    CELL_M,
    COURSE_GOAL,
    COURSE_ORIGIN,
    COURSE_SHAPE,
    COURSE_START,
)
from ses_core.worlds.identity import named_world
from storage.world_files import MOST_CELLS, read_text

GAZEBO_SUFFIXES = frozenset({".world", ".sdf"})

FLOOR_PREFIX, START_MODEL, GOAL_MODEL = "floor_", "start", "goal"
"""Models of our own worlds: see `storage.gazebo_world_writer`, which writes them."""

_RESOLUTION_M = 0.05
_FLOOR_NAME = re.compile(FLOOR_PREFIX + r"(\d{1,8})x(\d{1,8})")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shape:
    """A solid seen from above: a disc of a radius, or a box of half sizes, at a pose."""

    pose: Pose2D
    radius: float
    half_sizes: tuple[float, float]

    def reach(self) -> float:
        return self.radius or math.hypot(*self.half_sizes)

    def extents(self) -> tuple[float, float]:
        """Give how far it gets from its centre along x and y [m]."""
        if self.radius:
            return self.radius, self.radius
        cosine, sine = abs(math.cos(self.pose.yaw)), abs(math.sin(self.pose.yaw))
        half_x, half_y = self.half_sizes
        return cosine * half_x + sine * half_y, sine * half_x + cosine * half_y


def read_gazebo_world(path: Path) -> World:
    """Read the cylinders and boxes of a Gazebo world as seen from above.

    Models are read where they are described, not again in `<state>`. A world on BARN's lattice
    becomes BARN's course: its cells, start and goal, and open ground up to the goal. A world of
    our own writing gives back the very cells it was written from.

    Raises:
        WorldError: It is no SDF, declares entities, or has no cylinder or box.
    """
    text = read_text(path)
    if "<!DOCTYPE" in text:
        raise WorldError(f"{path} declares a document type, expected plain SDF without entities")
    try:
        world = ET.fromstring(text).find("world")
    except ET.ParseError as error:
        raise WorldError(f"{path} is no XML: {error}") from error
    if world is None:
        raise WorldError(f"{path} has no <world>, expected SDF")
    shapes = [shape for model in world.findall("model") for shape in _shapes(model, path)]
    if (floor := _declared_floor(world, path)) is not None:
        grid = _rasterise(shapes, floor.cells.shape, floor.resolution, floor.origin, margin=0.0)
        return named_world(path.stem, grid, source="sdf", course=_declared_course(world, path))
    if not shapes:
        raise WorldError(f"{path} has no cylinder or box, expected at least one obstacle")
    centres = np.array([(shape.pose.x, shape.pose.y) for shape in shapes])
    if _is_barn(shapes, centres):
        grid = _rasterise(shapes, COURSE_SHAPE, CELL_M, COURSE_ORIGIN, margin=0.0)
        return named_world(path.stem, grid, source="barn", course=(COURSE_START, COURSE_GOAL))
    reach = np.array([[shape.reach()] for shape in shapes])
    low, high = (centres - reach).min(axis=0), (centres + reach).max(axis=0)
    width, height = np.ceil((high - low) / _RESOLUTION_M).astype(np.int64).tolist()
    if width * height > MOST_CELLS:
        raise WorldError(f"{path} spans {high - low} m, expected at most {MOST_CELLS} cells")
    # Half a cell of margin keeps walls thinner than a cell from vanishing.
    grid = _rasterise(
        shapes,
        (height, width),
        _RESOLUTION_M,
        (float(low[0]), float(low[1])),
        margin=_RESOLUTION_M / 2,
    )
    return named_world(path.stem, grid, source="sdf")


def _declared_floor(world: ET.Element, path: Path) -> OccupancyGrid | None:
    """Give the empty grid that a world of our own writing states, None for any other."""
    for model in world.findall("model"):
        named = _FLOOR_NAME.fullmatch(model.get("name", ""))
        size = model.findtext("link/visual/geometry/box/size")
        if named is None or size is None:
            continue
        width, height = int(named[1]), int(named[2])
        length_m, width_m, _ = _numbers(size, 3, path)
        if not 0 < width * height <= MOST_CELLS:
            raise WorldError(
                f"{path} has a floor of {width} x {height} cells, expected 1 to {MOST_CELLS}"
            )
        resolution = length_m / width
        if resolution <= 0.0 or abs(width_m - height * resolution) > 1e-6 * abs(width_m):
            raise WorldError(
                f"{path} has a floor of {length_m} x {width_m} m for {width} x {height} cells, "
                "expected square cells"
            )
        corner = _pose(model, path)
        return OccupancyGrid(
            cells=np.zeros((height, width), dtype=np.bool_),
            resolution=resolution,
            origin=(corner.x, corner.y),
        )
    return None


def _declared_course(world: ET.Element, path: Path) -> tuple[Pose2D, tuple[float, float]] | None:
    """Give the start and goal that a world of our own writing states, if any."""
    marks = {model.get("name"): model for model in world.findall("model")}
    if START_MODEL not in marks or GOAL_MODEL not in marks:
        return None
    goal = _pose(marks[GOAL_MODEL], path)
    return _pose(marks[START_MODEL], path), (goal.x, goal.y)


def _is_barn(shapes: list[_Shape], centres: FloatArray) -> bool:
    """Recognise BARN: cylinders of 0.075 m on its lattice, filling its course's width."""
    lattice = (centres - COURSE_ORIGIN) / CELL_M - 0.5
    return (
        all(abs(shape.radius - CELL_M / 2) < 1e-3 for shape in shapes)
        and bool(np.abs(lattice - np.rint(lattice)).max() < 1e-2)
        and bool(np.allclose(centres.min(axis=0), (-4.425, 0.075), atol=1e-3))
        and bool(np.allclose(centres.max(axis=0), (-0.075, 9.525), atol=1e-3))
    )


def _rasterise(
    shapes: list[_Shape],
    shape_of_grid: tuple[int, int],
    resolution: float,
    origin: tuple[float, float],
    *,
    margin: float,
) -> OccupancyGrid:
    """Mark every cell whose centre lies in a shape grown by a margin [m]."""
    cells = np.zeros(shape_of_grid, dtype=np.bool_)
    for shape in shapes:
        # A long wall's window is as narrow as the wall: worlds of thousands stay quick to read.
        reach_x, reach_y = (extent + margin + resolution for extent in shape.extents())
        low_x, low_y, high_x, high_y = (
            max(0, math.floor((shape.pose.x - reach_x - origin[0]) / resolution)),
            max(0, math.floor((shape.pose.y - reach_y - origin[1]) / resolution)),
            math.ceil((shape.pose.x + reach_x - origin[0]) / resolution),
            math.ceil((shape.pose.y + reach_y - origin[1]) / resolution),
        )
        window = cells[low_y:high_y, low_x:high_x]
        rows, columns = np.indices(window.shape)
        centres = np.stack((low_x + columns, low_y + rows), axis=-1) + 0.5
        offsets = np.asarray(origin) + centres * resolution - (shape.pose.x, shape.pose.y)
        window |= _covers(shape, offsets, margin)
    return OccupancyGrid(cells=cells, resolution=resolution, origin=origin)


def _covers(shape: _Shape, offsets: FloatArray, margin: float) -> BoolArray:
    """Tell which offsets (H, W, 2) [m] from its centre a grown shape covers."""
    dx, dy = offsets[..., 0], offsets[..., 1]
    if shape.radius:
        return np.hypot(dx, dy) <= shape.radius + margin
    cosine, sine = math.cos(shape.pose.yaw), math.sin(shape.pose.yaw)
    along, across = cosine * dx + sine * dy, cosine * dy - sine * dx
    half_x, half_y = shape.half_sizes
    return (np.abs(along) <= half_x + margin) & (np.abs(across) <= half_y + margin)


def _shapes(model: ET.Element, path: Path) -> list[_Shape]:
    """Collect a model's cylinders and boxes."""
    shapes = []
    for link in model.findall("link"):
        for collision in link.findall("collision"):
            pose = compose(compose(_pose(model, path), _pose(link, path)), _pose(collision, path))
            radius = collision.findtext("geometry/cylinder/radius")
            size = collision.findtext("geometry/box/size")
            if radius is not None:
                shapes.append(
                    _Shape(pose=pose, radius=_numbers(radius, 1, path)[0], half_sizes=(0.0, 0.0))
                )
            elif size is not None:
                x, y, _ = _numbers(size, 3, path)
                shapes.append(_Shape(pose=pose, radius=0.0, half_sizes=(x / 2, y / 2)))
    return shapes


def _pose(element: ET.Element, path: Path) -> Pose2D:
    """Read an element's own pose, its roll and pitch left out."""
    text = element.findtext("pose")
    if text is None:
        return Pose2D(0.0, 0.0)
    x, y, _, _, _, yaw = _numbers(text, 6, path)
    return Pose2D(x, y, yaw)


def _numbers(text: str, count: int, path: Path) -> list[float]:
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise WorldError(f"{path} has {text.strip()!r}, expected {count} numbers")
    return numbers
