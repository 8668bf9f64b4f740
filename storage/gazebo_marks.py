"""The marks by which Gazebo worlds of our own writing state their grid, start and goal.

SDF has no word for these: see `storage.gazebo_world_writer`, which writes them.
"""

import math
import re
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from ses_core.errors import WorldError
from ses_core.geometry import Pose2D
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.grids import MOST_CELLS

# Nobody else's models are called so: any world may have a floor_10x10 and a start.
FLOOR_PREFIX, START_MODEL, GOAL_MODEL = "ses_floor_", "ses_start", "ses_goal"

_FLOOR_NAME = re.compile(FLOOR_PREFIX + r"(\d{1,8})x(\d{1,8})")


def is_marked(text: str) -> bool:
    """Tell whether SDF may have marks, whose visuals then have to be read."""
    return FLOOR_PREFIX in text


def declared_floor(world: ET.Element, path: Path) -> OccupancyGrid | None:
    """Give the empty grid that a world of our own writing states, None for any other."""
    for model in world.findall("model"):
        named = _FLOOR_NAME.fullmatch(model.get("name", ""))
        size = model.findtext("link/visual/geometry/box/size")
        # What is marked is ground: a model to bump into is none of our marks.
        if named is None or size is None or next(model.iter("collision"), None) is not None:
            continue
        width, height = int(named[1]), int(named[2])
        length_m, width_m, _ = sdf_numbers(size, 3, path)
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


def declared_course(world: ET.Element, path: Path) -> tuple[Pose2D, tuple[float, float]] | None:
    """Give the start and goal that a world of our own writing states, if any."""
    marks = {model.get("name"): model for model in world.findall("model")}
    if START_MODEL not in marks or GOAL_MODEL not in marks:
        return None
    goal = _pose(marks[GOAL_MODEL], path)
    return _pose(marks[START_MODEL], path), (goal.x, goal.y)


def sdf_numbers(text: str | None, count: int, path: Path) -> list[float]:
    """Read the numbers of an element.

    Raises:
        WorldError: They are others than `count` finite ones.
    """
    try:
        numbers = [float(word) for word in (text or "").split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        found = repr(text.strip()[:80]) if text else "nothing"
        raise WorldError(f"{path} has {found}, expected {count} numbers")
    return numbers


def _pose(element: ET.Element, path: Path) -> Pose2D:
    """Read an element's own pose, its roll and pitch left out."""
    text = element.findtext("pose")
    if text is None:
        return Pose2D(0.0, 0.0)
    x, y, _, _, _, yaw = sdf_numbers(text, 6, path)
    return Pose2D(x, y, yaw)
