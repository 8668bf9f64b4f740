"""Single map files: map_server YAML and images.

What a robot may not drive into is occupied: walls, and whatever a map does not know.
"""

from pathlib import Path

import numpy as np
import yaml
from PIL import Image, UnidentifiedImageError
from pydantic import BaseModel, Field, ValidationError

from ses_core.arrays import BoolArray, Float32Array
from ses_core.errors import WorldError
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.identity import named_world

IMAGE_SUFFIXES = frozenset({".png", ".pgm", ".bmp", ".jpg", ".jpeg", ".tif", ".tiff"})
MAP_SUFFIXES = frozenset({".yaml", ".yml"})

FREE_THRESHOLD = 0.196
"""map_server's default: a pixel less dark than this share is free."""

_UNKNOWN_DARKNESS = 50 / 255
"""Every map saver writes 205 for unknown, which Nav2's usual `free_thresh` of 0.25 calls free."""

_FINEST_M = 0.025
"""Maps finer than this are coarsened: floor plans of 1 cm pixels would cost 25 times the memory
and time of 5 cm ones, and no planner cell is finer."""

_COARSE_M = 0.05

_LARGEST_FILE_MIB = 256
MOST_CELLS = 64_000_000


class _MapServerFile(BaseModel):
    """The keys of a map_server YAML that decide what is free."""

    image: str
    resolution: float = Field(gt=0)
    origin: tuple[float, float, float]
    negate: int = 0
    free_thresh: float = FREE_THRESHOLD


def read_map_server(path: Path) -> World:
    """Read a map_server YAML and its image; a turned origin only turns the world as a whole.

    Raises:
        WorldError: A key is missing or wrong, or the image cannot be read.
    """
    try:
        content = yaml.safe_load(read_text(path))
        keys = _MapServerFile.model_validate(content)
    except (yaml.YAMLError, RecursionError) as error:
        raise WorldError(f"{path} is no YAML: {first_line(error)}") from error
    except ValidationError as error:
        problem = error.errors()[0]
        key = ".".join(map(str, problem["loc"])) or "content"
        raise WorldError(
            f"{path} is no map_server file: {key}: {problem['msg'].lower()}"
        ) from error
    darkness = read_darkness(path.parent / keys.image)
    if keys.negate:
        darkness = 1.0 - darkness
    is_unknown = np.abs(darkness - _UNKNOWN_DARKNESS) < 1e-3
    occupied = (darkness >= keys.free_thresh) | is_unknown
    grid = _grid_from_picture(path, occupied, keys.resolution, (keys.origin[0], keys.origin[1]))
    return named_world(path.stem, grid, source="map_server")


def read_image(path: Path, *, resolution: float) -> World:
    """Read an image, light = free, at `resolution` [m per pixel].

    Raises:
        WorldError: It is no image, too large, or nothing in it is free.
    """
    occupied = read_darkness(path) >= FREE_THRESHOLD
    return named_world(
        path.stem, _grid_from_picture(path, occupied, resolution, (0.0, 0.0)), source="image"
    )


def read_darkness(path: Path) -> Float32Array:
    """Read how dark an image's pixels (H, W) are: 0 white, 1 black; colours are averaged."""
    try:
        with Image.open(path) as image:
            if image.width * image.height > MOST_CELLS:
                raise WorldError(
                    f"{path} has {image.width} x {image.height} pixels, "
                    f"expected at most {MOST_CELLS}"
                )
            is_deep, is_grey = image.mode.startswith("I"), image.mode in {"1", "L"}
            wanted = image if is_deep else image.convert("L" if is_grey else "RGBA")
            pixels = np.asarray(wanted, dtype=np.float32)
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, ValueError) as error:
        raise WorldError(f"{path} cannot be read as an image: {first_line(error)}") from error
    if is_grey:
        return 1.0 - pixels / 255.0
    if is_deep:
        return 1.0 - pixels / 65535.0
    # What is transparent shows the white paper behind it.
    opacity = pixels[..., 3] / 255.0
    return opacity * (1.0 - pixels[..., :3].mean(axis=2) / 255.0)


def _grid_from_picture(
    path: Path, occupied: BoolArray, resolution: float, origin: tuple[float, float]
) -> OccupancyGrid:
    """Lay a picture, row 0 on top, out as a map, cut down to what is free and one cell around.

    A picture finer than needed is coarsened.
    """
    factor = max(1, round(_COARSE_M / resolution)) if resolution < _FINEST_M else 1
    cells = occupied[::-1]
    if factor > 1:
        height, width = (-(-extent // factor) for extent in cells.shape)
        padded = np.ones((height * factor, width * factor), dtype=np.bool_)
        padded[: cells.shape[0], : cells.shape[1]] = cells
        # Occupied if any part is: a thin wall must not leak.
        cells = np.asarray(padded.reshape(height, factor, width, factor).any(axis=(1, 3)))
    if cells.all():
        raise WorldError(f"{path} has no free cell, expected light pixels where it is free")
    resolution *= factor
    rows, columns = (np.flatnonzero(~cells.all(axis=axis)) for axis in (1, 0))
    bottom, left = max(0, rows[0] - 1), max(0, columns[0] - 1)
    return OccupancyGrid(
        cells=np.ascontiguousarray(cells[bottom : rows[-1] + 2, left : columns[-1] + 2]),
        resolution=resolution,
        origin=(origin[0] + float(left) * resolution, origin[1] + float(bottom) * resolution),
    )


def read_text(path: Path) -> str:
    """Read a text file of reasonable size.

    Raises:
        WorldError: It is too large, or no UTF-8 text.
    """
    try:
        if path.stat().st_size > _LARGEST_FILE_MIB << 20:
            raise WorldError(f"{path} is larger than {_LARGEST_FILE_MIB} MiB")
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise WorldError(f"{path} cannot be read as text: {first_line(error)}") from error


def first_line(error: Exception) -> str:
    """Give the first line of a foreign error's text."""
    return (str(error).splitlines() or [type(error).__name__])[0]
