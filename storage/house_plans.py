"""HouseExpo's floor plans in JSON: the outline of a house's free ground, in metres.

Keys of a plan: `id`, `verts` (K, 2) [m] of the outline, `bbox` with `min` and `max`, `room_num`
and `room_category`, the boxes [x0, y0, x1, y1] [m] of its rooms by what they are used as.
"""

import json
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from ses_core.errors import NotAMapError, WorldError
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.grids import MOST_CELLS, coarsened, cut_to_free
from ses_core.worlds.identity import named_world
from storage.world_files import first_line, named_errors

PLAN_SUFFIXES = frozenset({".json"})

PIXEL_M = 0.01
"""HouseExpo draws its own pictures (vis_maps) with 100 pixels per metre."""

_BORDER_PIXELS = 25


def read_house_plan(path: Path, text: str) -> World:
    """Draw a plan's outline as HouseExpo's own pictures do: its inside and its line are free.

    Unlike the pictures, whose rows run down the y axis, the world keeps the plan's coordinates.

    Raises:
        NotAMapError: It is some other JSON.
        WorldError: Its outline cannot be used.
    """
    try:
        plan = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise WorldError(f"{path} is no JSON: {first_line(error)}") from error
    if not (isinstance(plan, dict) and "verts" in plan):
        raise NotAMapError(f"{path} has no outline, expected HouseExpo's key verts")
    try:
        outline = np.asarray(plan["verts"], dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise WorldError(f"{path} has verts that are no numbers, expected pairs [m]") from error
    if outline.ndim != 2 or outline.shape[1] != 2 or len(outline) < 3:
        raise WorldError(f"{path} has verts of shape {outline.shape}, expected (3 or more, 2)")
    if not np.isfinite(outline).all() or np.abs(outline).max() * np.sqrt(2.0) > 1e6:
        raise WorldError(f"{path} has verts beyond any house, expected metres")
    # Cut off, not rounded, as HouseExpo does.
    corners = (outline / PIXEL_M).astype(np.int64)
    low = corners.min(axis=0) - _BORDER_PIXELS
    width, height = (int(extent) for extent in corners.max(axis=0) - low + _BORDER_PIXELS)
    if width * height > MOST_CELLS:
        raise WorldError(
            f"{path} spans {width} x {height} pixels, expected at most {MOST_CELLS}: "
            "are its verts in metres?"
        )
    picture = Image.new("1", (width, height), 0)
    ImageDraw.Draw(picture).polygon(
        [(x, y) for x, y in (corners - low).tolist()], fill=1, outline=1
    )
    grid = OccupancyGrid(
        cells=~np.asarray(picture, dtype=np.bool_),
        resolution=PIXEL_M,
        origin=(float(low[0]) * PIXEL_M, float(low[1]) * PIXEL_M),
    )
    with named_errors(path):
        return named_world(path.stem, cut_to_free(coarsened(grid)), source="houseexpo")
