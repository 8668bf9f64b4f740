"""Places as files for other tools: map_server, PNG, Gazebo and numpy.

Pictures have one pixel per cell, the highest y on top, in the three values that every map saver
writes: 0 occupied, 254 free, 205 unknown. Unknown is what was free but not observed; what counts as
occupied stays occupied.
"""

import io
import json
from pathlib import Path
from typing import Literal

import numpy as np
import yaml
from PIL import Image, PngImagePlugin

from ses_core.arrays import ByteArray
from ses_core.place import Place
from storage.array_worlds import array_world
from storage.durable_files import replace_file
from storage.gazebo_world_writer import gazebo_world

PlaceFormat = Literal["sdf", "map-server", "png", "npz"]

FREE_PIXEL, OCCUPIED_PIXEL, UNKNOWN_PIXEL = 254, 0, 205

_OCCUPIED_THRESHOLD, _FREE_THRESHOLD = 0.65, 0.196
"""map_server's own; Nav2's usual 0.25 would call unknown pixels free."""


def write_place(path: Path, place: Place, *, format: PlaceFormat) -> None:  # noqa: A002
    """Write a place; a map_server's picture lies beside its YAML, under the same name.

    Raises:
        ArtifactError: The disk is full or failing.
    """
    if format == "map-server":
        picture = path.with_suffix(".pgm")
        # The YAML last: whoever sees it finds its picture.
        replace_file(picture, _encode(place_pixels(place), "PPM"))
        replace_file(path, _map_server_yaml(place, picture.name).encode())
    elif format == "png":
        replace_file(path, _encode(place_pixels(place), "PNG", about=_about(place)))
    elif format == "npz":
        replace_file(path, array_world(place))
    else:
        replace_file(path, gazebo_world(place))


def place_pixels(place: Place) -> ByteArray:
    """Give a place's cells as a map saver's pixels (H, W), the highest y on top."""
    free = np.where(place.observed, np.uint8(FREE_PIXEL), np.uint8(UNKNOWN_PIXEL))
    return np.where(place.grid.cells, np.uint8(OCCUPIED_PIXEL), free)[::-1]


def _map_server_yaml(place: Place, picture: str) -> str:
    x, y = place.grid.origin
    content = {
        "image": picture,
        "mode": "trinary",
        "resolution": float(place.grid.resolution),
        "origin": [float(x), float(y), 0.0],
        "negate": 0,
        "occupied_thresh": _OCCUPIED_THRESHOLD,
        "free_thresh": _FREE_THRESHOLD,
    }
    return yaml.safe_dump(content, sort_keys=False, default_flow_style=None)


def _about(place: Place) -> PngImagePlugin.PngInfo:
    """Say in the picture's own text what its pixels mean."""
    start, goal = place.start, place.goal
    about = PngImagePlugin.PngInfo()
    about.add_text(
        "Description",
        json.dumps(
            {
                "identity": place.identity,
                "resolution_m": place.grid.resolution,
                "origin_m": place.grid.origin,
                "start": None if start is None else [start.x, start.y, start.yaw],
                "goal_m": goal,
            }
        ),
    )
    return about


def _encode(pixels: ByteArray, kind: str, *, about: PngImagePlugin.PngInfo | None = None) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, format=kind, pnginfo=about)
    return buffer.getvalue()
