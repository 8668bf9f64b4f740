"""A place as a Gazebo world, for Gazebo Classic and for the new Gazebo (gz-sim).

SDF 1.6 is what both read, and nothing is fetched: ground, sun and materials stand in the file.
The obstacles are one static model `walls` of boxes, merged cells. Flat coloured marks without
collision say what SDF has no word for: `ses_floor_<W>x<H>` has its pose in the grid's lower left
corner and spans W x H cells, `ses_start` and `ses_goal` lie where to drive. What was not observed
is open ground.
"""

import re
from collections.abc import Iterator
from xml.etree import ElementTree as ET

from ses_core.geometry import Pose2D
from ses_core.occupancy import OccupancyGrid
from ses_core.place import Place
from ses_core.simulation.rendering import WALL_HEIGHT_M, merge_boxes
from storage.gazebo_marks import FLOOR_PREFIX, GOAL_MODEL, START_MODEL

_GROUND_SIDE_M = 200.0
_MARK_M = 0.002
"""Thickness of marks on the ground; they lie above each other so that none flickers."""

_WALL, _GROUND, _FLOOR = "0.45 0.45 0.5 1", "0.6 0.6 0.6 1", "0.85 0.87 0.9 1"
_START, _GOAL = "0 0.6 0.3 1", "0.85 0.35 0 1"


def gazebo_world(place: Place) -> bytes:
    """Describe a place as SDF; `read_gazebo_world` gives the same cells, start and goal back."""
    sdf = ET.Element("sdf", version="1.6")
    # The new Gazebo makes topics of a world's name, which bear no other letters.
    world = ET.SubElement(sdf, "world", name=re.sub(r"\W", "_", place.identity, flags=re.ASCII))
    _add_physics(world)
    _add_sun(world)
    _add_ground(world)
    _add_walls(world, place.grid)
    _add_floor(world, place.grid)
    if place.start is not None:
        body = _add_mark(world, START_MODEL, place.start, level=2)
        # Longer than wide: it shows the heading.
        _add_box_visual(body, "mark", (0.4, 0.12, _MARK_M), _START)
    if place.goal is not None:
        body = _add_mark(world, GOAL_MODEL, Pose2D(*place.goal), level=2)
        _add_box_visual(body, "mark", (0.25, 0.25, _MARK_M), _GOAL)
    ET.indent(sdf)
    return ET.tostring(sdf, encoding="utf-8", xml_declaration=True) + b"\n"


def _add_physics(world: ET.Element) -> None:
    physics = ET.SubElement(world, "physics", name="default", type="ode", default="1")
    _texts(physics, max_step_size="0.001", real_time_factor="1", real_time_update_rate="1000")


def _add_sun(world: ET.Element) -> None:
    light = ET.SubElement(world, "light", name="sun", type="directional")
    _texts(
        light,
        cast_shadows="1",
        pose="0 0 10 0 0 0",
        diffuse="0.8 0.8 0.8 1",
        specular="0.2 0.2 0.2 1",
        direction="-0.5 0.1 -0.9",
    )


def _add_ground(world: ET.Element) -> None:
    link = _static_link(world, "ground_plane", "0 0 0 0 0 0")
    for kind in ("collision", "visual"):
        part = ET.SubElement(link, kind, name=kind)
        plane = ET.SubElement(ET.SubElement(part, "geometry"), "plane")
        _texts(plane, normal="0 0 1", size=f"{_GROUND_SIDE_M} {_GROUND_SIDE_M}")
        if kind == "visual":
            _add_colour(part, _GROUND)


def _add_walls(world: ET.Element, grid: OccupancyGrid) -> None:
    """Add the occupied cells as boxes with the grid's lower left corner as their origin."""
    boxes = list(_boxes(grid))
    if not boxes:
        return
    link = _static_link(world, "walls", _pose_text(Pose2D(*grid.origin)))
    for index, (x, y, length, width) in enumerate(boxes):
        pose = f"{x!r} {y!r} {WALL_HEIGHT_M / 2} 0 0 0"
        size = f"{length!r} {width!r} {WALL_HEIGHT_M}"
        for kind in ("collision", "visual"):
            part = ET.SubElement(link, kind, name=f"{kind}_{index}")
            _texts(part, pose=pose)
            _texts(ET.SubElement(ET.SubElement(part, "geometry"), "box"), size=size)
            if kind == "visual":
                _add_colour(part, _WALL)


def _boxes(grid: OccupancyGrid) -> Iterator[tuple[float, float, float, float]]:
    """Give the boxes that cover the occupied cells: centre, length and width [m]."""
    for bottom, left, top, right in merge_boxes(grid.cells).tolist():
        yield (
            (left + right) / 2 * grid.resolution,
            (bottom + top) / 2 * grid.resolution,
            (right - left) * grid.resolution,
            (top - bottom) * grid.resolution,
        )


def _add_floor(world: ET.Element, grid: OccupancyGrid) -> None:
    height, width = grid.cells.shape
    body = _add_mark(world, f"{FLOOR_PREFIX}{width}x{height}", Pose2D(*grid.origin), level=1)
    visual = _add_box_visual(body, "mark", (grid.width_m, grid.height_m, _MARK_M), _FLOOR)
    _texts(visual, pose=f"{grid.width_m / 2!r} {grid.height_m / 2!r} 0 0 0 0")


def _add_mark(world: ET.Element, name: str, pose: Pose2D, *, level: int) -> ET.Element:
    """Add a model to lie flat on the ground; gives its link."""
    return _static_link(world, name, _pose_text(pose, z=(level - 0.5) * _MARK_M))


def _add_box_visual(
    link: ET.Element, name: str, size: tuple[float, float, float], colour: str
) -> ET.Element:
    visual = ET.SubElement(link, "visual", name=name)
    box = ET.SubElement(ET.SubElement(visual, "geometry"), "box")
    _texts(box, size=" ".join(repr(float(length)) for length in size))
    _add_colour(visual, colour)
    _texts(visual, cast_shadows="0")
    return visual


def _add_colour(visual: ET.Element, colour: str) -> None:
    _texts(ET.SubElement(visual, "material"), ambient=colour, diffuse=colour)


def _static_link(world: ET.Element, name: str, pose: str) -> ET.Element:
    model = ET.SubElement(world, "model", name=name)
    _texts(model, static="1", pose=pose)
    return ET.SubElement(model, "link", name="link")


def _pose_text(pose: Pose2D, *, z: float = 0.0) -> str:
    return f"{float(pose.x)!r} {float(pose.y)!r} {z} 0 0 {float(pose.yaw)!r}"


def _texts(parent: ET.Element, **texts: str) -> None:
    for name, text in texts.items():
        ET.SubElement(parent, name).text = text
