"""Single map files: map_server YAML and images.

What a robot may not drive into is occupied: walls, and whatever a map does not know.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Literal

import numpy as np
import yaml
from PIL import Image, UnidentifiedImageError
from pydantic import BaseModel, Field, ValidationError, model_validator

from ses_core.arrays import BoolArray, Float32Array
from ses_core.errors import NotAMapError, WorldError
from ses_core.geometry import Pose2D
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.grids import MOST_CELLS, coarsened, cut_to_free, levelled
from ses_core.worlds.identity import named_world

IMAGE_SUFFIXES = frozenset({".png", ".pgm", ".bmp", ".jpg", ".jpeg", ".tif", ".tiff"})
MAP_SUFFIXES = frozenset({".yaml", ".yml"})

_IMAGE_FORMATS = ("PNG", "PPM", "BMP", "JPEG", "TIFF", "GIF", "WEBP")
"""Whatever its name says, nothing else is opened: Pillow would run Ghostscript for an EPS."""

FREE_THRESHOLD = 0.196
"""map_server's default: a pixel less dark than this share is free."""

_UNKNOWN_DARKNESS = 50 / 255
"""Every map saver writes 205 for unknown, which Nav2's usual `free_thresh` of 0.25 calls free."""

OCCUPIED_PERCENT = 50.0
"""From this occupancy a cell of a `nav_msgs/OccupancyGrid`, or of a map in shades, is occupied."""

LARGEST_FILE_MIB = 256

_LARGEST_YAML_MIB = 1
"""A map's keys take some hundred bytes; parsing takes a second and 100 MB per MiB."""

_DEEPEST_YAML = 64

# PyYAML brings the fast one where it was built with libyaml.
_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _MapServerFile(BaseModel):
    """The keys of a map_server YAML."""

    image: str
    resolution: float = Field(gt=0, allow_inf_nan=False)
    origin: tuple[float, float, float]
    negate: int = 0
    occupied_thresh: float = Field(0.65, gt=0, le=1)
    free_thresh: float = Field(FREE_THRESHOLD, ge=0, lt=1)
    mode: Literal["trinary", "scale", "raw"] = "trinary"

    @model_validator(mode="after")
    def _in_order(self) -> "_MapServerFile":
        if self.free_thresh >= self.occupied_thresh:
            raise ValueError("free_thresh should be less than occupied_thresh")
        if not np.isfinite(self.origin).all():
            raise ValueError("origin should be three finite numbers")
        return self


def read_map_server(path: Path) -> World:
    """Read a map_server YAML and its image, in the frame of the map.

    Raises:
        WorldError: A key is missing or wrong, or the image cannot be read.
    """
    keys = _read_keys(path)
    picture = path.parent / keys.image
    try:
        pixels = read_pixels(picture)
    except FileNotFoundError as error:
        raise WorldError(
            f"{path} names the image {keys.image}, expected it at {picture}"
        ) from error
    occupied = _occupied(keys, *pixels)
    with named_errors(path):
        grid = levelled(occupied[::-1], keys.resolution, Pose2D(*keys.origin))
        return named_world(path.stem, cut_to_free(coarsened(grid)), source="map_server")


def read_image(path: Path, *, resolution: float, content: IO[bytes] | None = None) -> World:
    """Read an image, light = free, at `resolution` [m per pixel].

    Args:
        path: Names the world, and is read unless there is `content`.
        resolution: Edge of a pixel [m].
        content: What the file holds, where it lies in an archive.

    Raises:
        WorldError: It is no image, too large, or nothing in it is free.
    """
    lightness, opacity = read_pixels(path, content=content)
    # What is transparent shows the white paper behind it.
    occupied = opacity * (1.0 - lightness) >= FREE_THRESHOLD
    with named_errors(path):
        grid = OccupancyGrid(cells=occupied[::-1], resolution=resolution)
        return named_world(path.stem, cut_to_free(coarsened(grid)), source="image")


def read_pixels(
    path: Path, *, content: IO[bytes] | None = None
) -> tuple[Float32Array, Float32Array]:
    """Read how light an image's pixels (H, W) are, 0 black, 1 white, and how opaque.

    Colours are averaged.

    Raises:
        WorldError: It is no image, or too large.
    """
    try:
        with Image.open(content or path, formats=_IMAGE_FORMATS) as image:
            if image.width * image.height > MOST_CELLS:
                raise WorldError(
                    f"{path} has {image.width} x {image.height} pixels, "
                    f"expected at most {MOST_CELLS}"
                )
            is_deep, is_grey = image.mode.startswith("I"), image.mode in {"1", "L"}
            wanted = image if is_deep else image.convert("L" if is_grey else "RGBA")
            pixels = np.asarray(wanted)
    except FileNotFoundError:
        raise
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, ValueError) as error:
        raise WorldError(f"{path} cannot be read as an image: {first_line(error)}") from error
    if is_grey or is_deep:
        lightness = np.divide(pixels, 65535.0 if is_deep else 255.0, dtype=np.float32)
        return lightness, np.broadcast_to(np.float32(1.0), pixels.shape)
    # Bytes until a pixel is one number: floats of every colour would take 16 bytes a pixel.
    light = pixels[..., 0].astype(np.uint16)
    light += pixels[..., 1]
    light += pixels[..., 2]
    return (
        np.divide(light, 3 * 255.0, dtype=np.float32),
        np.divide(pixels[..., 3], 255.0, dtype=np.float32),
    )


def named_picture(path: Path) -> Path | None:
    """Give the picture that a map_server YAML names; None where it is none."""
    try:
        content = _yaml(path)
    except WorldError:
        return None
    named = content.get("image") if isinstance(content, dict) else None
    return path.parent / named if isinstance(named, str) else None


def _read_keys(path: Path) -> _MapServerFile:
    try:
        content = _yaml(path)
        if not isinstance(content, dict) or "image" not in content:
            raise NotAMapError(
                f"{path} is no map_server file, expected the keys image, resolution and origin"
            )
        return _MapServerFile.model_validate(content)
    except ValidationError as error:
        problem = error.errors()[0]
        key = ".".join(map(str, problem["loc"])) or "content"
        said = problem["msg"].removeprefix("Value error, ").lower()
        raise WorldError(f"{path} is no map_server file: {key}: {said}") from error


def _yaml(path: Path) -> object:
    text = read_text(path, most_mib=_LARGEST_YAML_MIB, too_large=NotAMapError)
    try:
        depth = 0
        # libyaml's loader calls itself in C, where too deep is a crash: its events come flat.
        for event in yaml.parse(text, Loader=_Loader):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > _DEEPEST_YAML:
                raise NotAMapError(f"{path} is no YAML of a map: it nests {depth} deep")
        return yaml.load(text, Loader=_Loader)
    except (yaml.YAMLError, ValueError) as error:
        raise WorldError(f"{path} is no YAML: {first_line(error)}") from error


def _occupied(keys: _MapServerFile, lightness: Float32Array, opacity: Float32Array) -> BoolArray:
    """Interpret pixels (H, W) as map_server does; what is unknown counts as occupied."""
    darkness = lightness if keys.negate else 1.0 - lightness
    if keys.mode == "raw":
        # The value itself is the percentage, and unknown above 100.
        percent = np.rint(255.0 * (1.0 - darkness))
        return (percent >= OCCUPIED_PERCENT) | (opacity < 1.0)
    is_unknown = np.abs(darkness - _UNKNOWN_DARKNESS) < 1e-3
    if keys.mode == "trinary":
        # What is transparent shows the white paper behind it.
        return (opacity * darkness >= keys.free_thresh) | is_unknown
    shade = (darkness - keys.free_thresh) / (keys.occupied_thresh - keys.free_thresh)
    return (shade * 100.0 >= OCCUPIED_PERCENT) | is_unknown | (opacity < 1.0)


@contextmanager
def named_errors(path: Path) -> Iterator[None]:
    """Say which file it was when something is wrong with what it holds."""
    try:
        yield
    except WorldError as error:
        raise type(error)(f"{path}: {error}") from error


def read_text(
    path: Path, *, most_mib: int = LARGEST_FILE_MIB, too_large: type[WorldError] = WorldError
) -> str:
    """Read a text file of reasonable size.

    Raises:
        WorldError: It is too large (or what `too_large` says), or no UTF-8 text.
    """
    try:
        if path.stat().st_size > most_mib << 20:
            raise too_large(f"{path} is larger than {most_mib} MiB")
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise WorldError(f"{path} cannot be read as text: {first_line(error)}") from error


def first_line(error: Exception) -> str:
    """Give the first line of a foreign error's text."""
    return (str(error).splitlines() or [type(error).__name__])[0]
