"""World sets: folders of `worlds.parquet` and a preview, and whatever else holds worlds."""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ses_core.errors import SchemaError, WorldError
from ses_core.geometry import Pose2D
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from storage.array_worlds import ARRAY_SUFFIX, read_array_world
from storage.durable_files import replace_file, sync_file, sync_folder, temporary_name
from storage.gazebo_worlds import GAZEBO_SUFFIXES, read_gazebo_world
from storage.world_files import IMAGE_SUFFIXES, MAP_SUFFIXES, read_image, read_map_server

WORLDS_FILE = "worlds.parquet"
PREVIEW_FILE = "preview.png"
SPLIT_FILE = "split.csv"
_SCHEMA_VERSION = "1"

_SCHEMA = pa.schema(
    [
        pa.field("world_id", pa.string(), nullable=False),
        pa.field("name", pa.string(), nullable=False),
        pa.field("source", pa.string(), nullable=False),
        # Row-major from the lowest y, 8 cells per byte, first cell in the highest bit.
        pa.field("cells", pa.binary(), nullable=False),
        pa.field("height_cells", pa.int64(), nullable=False),
        pa.field("width_cells", pa.int64(), nullable=False),
        pa.field("resolution_m", pa.float64(), nullable=False),
        pa.field("origin_x_m", pa.float64(), nullable=False),
        pa.field("origin_y_m", pa.float64(), nullable=False),
        pa.field("start_x_m", pa.float64()),
        pa.field("start_y_m", pa.float64()),
        pa.field("start_yaw_rad", pa.float64()),
        pa.field("goal_x_m", pa.float64()),
        pa.field("goal_y_m", pa.float64()),
        pa.field("width_m", pa.float64(), nullable=False),
        pa.field("height_m", pa.float64(), nullable=False),
        pa.field("free_fraction", pa.float64(), nullable=False),
    ],
    metadata={"ses.schema_version": _SCHEMA_VERSION},
)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldsFound:
    """What some paths hold: worlds, and the files that are no maps."""

    worlds: tuple[World, ...]
    passed_over: tuple[Path, ...]


def write_world_set(directory: Path, worlds: Sequence[World]) -> None:
    """Write a world set and its contact sheet, replacing one that is there.

    Raises:
        WorldError: There is no world, or two have the same id.
    """
    # Matplotlib takes half a second to import: only who draws pays for it.
    from ses_core.pictures.world_figure import world_sheet

    if not worlds:
        raise WorldError(f"no world to write to {directory}, expected at least one")
    ids = [world.world_id for world in worlds]
    if len(set(ids)) != len(ids):
        raise WorldError(f"world {max(ids, key=ids.count)} is there twice, expected distinct ones")
    directory.mkdir(parents=True, exist_ok=True)
    target = directory / WORLDS_FILE
    temporary = temporary_name(target)
    pq.write_table(
        pa.Table.from_pylist([_row(world) for world in worlds], schema=_SCHEMA),
        temporary,
        compression="zstd",
        write_page_checksum=True,
    )
    sync_file(temporary)
    temporary.replace(target)
    sync_folder(directory)
    replace_file(directory / PREVIEW_FILE, world_sheet(worlds))


def read_worlds(
    paths: Sequence[Path], *, part: str | None = None, resolution: float | None = None
) -> list[World]:
    """Read all worlds of some paths; see `find_worlds`."""
    return list(find_worlds(paths, part=part, resolution=resolution).worlds)


def find_worlds(
    paths: Sequence[Path], *, part: str | None = None, resolution: float | None = None
) -> WorldsFound:
    """Read all worlds of some paths: world sets, map files and worlds, or folders of these.

    In a folder, what is no map is passed over; a file that is named must be one. The same
    world found twice counts once.

    Args:
        paths: Files and folders, read in this order, folders by file name, numbers in it by value.
        part: Only the worlds that the folder's `split.csv` puts into this part.
        resolution: Of images that carry none [m per pixel].

    Raises:
        WorldError: A path is missing, a map cannot be read, or nothing is found.
    """
    worlds: dict[str, World] = {}
    passed_over: list[Path] = []
    for path in paths:
        if not path.exists():
            raise WorldError(f"{path} is missing, expected worlds")
        for file in _world_files(path, part=part, passed_over=passed_over):
            for world in _read_file(file, resolution):
                worlds.setdefault(world.world_id, world)
    if not worlds:
        where = ", ".join(map(str, paths))
        raise WorldError(
            f"no world in {where} ({len(passed_over)} files that are no maps), expected a world "
            "set, maps (yaml, png, pgm) or .world files"
        )
    return WorldsFound(worlds=tuple(worlds.values()), passed_over=tuple(passed_over))


def _world_files(path: Path, *, part: str | None, passed_over: list[Path]) -> Iterator[Path]:
    """List the files to read, noting those that are no maps."""
    if path.is_file():
        yield path
        return
    if (path / WORLDS_FILE).is_file() and part is None:
        yield path / WORLDS_FILE
        return
    files = sorted((file for file in path.iterdir() if file.is_file()), key=_natural_order)
    maps = [file for file in files if file.suffix.lower() in MAP_SUFFIXES]
    described = {file.stem for file in maps}
    chosen = _names_of_part(path, part) if part is not None else None
    for file in files:
        suffix = file.suffix.lower()
        is_picture = suffix in IMAGE_SUFFIXES
        if file.name == SPLIT_FILE or (is_picture and file.stem in described):
            continue
        is_world = suffix in GAZEBO_SUFFIXES or suffix == ARRAY_SUFFIX
        if not (is_picture or is_world or suffix in MAP_SUFFIXES):
            passed_over.append(file)
        elif chosen is None or file.stem in chosen:
            yield file


def _natural_order(file: Path) -> list[tuple[int, str]]:
    """Sort `world_2` before `world_10`."""
    return [(int(part) if part.isdecimal() else -1, part) for part in re.split(r"(\d+)", file.name)]


def _names_of_part(directory: Path, part: str) -> frozenset[str]:
    """Read which names a folder's `split.csv` puts into a part: its columns are name, part."""
    split = directory / SPLIT_FILE
    if not split.is_file():
        raise WorldError(f"{directory} has no {SPLIT_FILE}, expected one for the part {part!r}")
    with split.open(encoding="utf-8", newline="") as lines:
        rows = [row for row in csv.reader(lines) if row][1:]
    if any(len(row) < 2 for row in rows):
        raise WorldError(f"{split} has a row of one column, expected name and part")
    names = frozenset(row[0].strip() for row in rows if row[1].strip() == part)
    if not names:
        known = ", ".join(sorted({row[1].strip() for row in rows}))
        raise WorldError(f"{split} has no part {part!r}, expected one of {known}")
    return names


def _read_file(file: Path, resolution: float | None) -> list[World]:
    suffix = file.suffix.lower()
    if suffix == ".parquet":
        return _read_world_set(file)
    if suffix in MAP_SUFFIXES:
        return [read_map_server(file)]
    if suffix in GAZEBO_SUFFIXES:
        return [read_gazebo_world(file)]
    if suffix == ARRAY_SUFFIX:
        return [read_array_world(file)]
    if suffix in IMAGE_SUFFIXES:
        if resolution is None:
            raise WorldError(f"{file} carries no resolution, expected --resolution [m per pixel]")
        return [read_image(file, resolution=resolution)]
    raise WorldError(f"{file} is no map, expected {WORLDS_FILE}, yaml, an image, .world or .npz")


def _read_world_set(file: Path) -> list[World]:
    try:
        with pq.ParquetFile(file, page_checksum_verification=True) as parquet:
            if not parquet.schema_arrow.equals(_SCHEMA):
                raise SchemaError(
                    f"{file} has other columns than a world set of version {_SCHEMA_VERSION}"
                )
            rows = parquet.read().to_pylist()
    except (pa.ArrowException, OSError) as error:
        raise WorldError(f"{file} cannot be read as a world set: {error}") from error
    return [_world(row, file) for row in rows]


def _row(world: World) -> dict[str, object]:
    grid = world.grid
    start, goal = world.course or (None, None)
    return {
        "world_id": world.world_id,
        "name": world.name or world.world_id,
        "source": world.source,
        "cells": np.packbits(grid.cells).tobytes(),
        "height_cells": grid.cells.shape[0],
        "width_cells": grid.cells.shape[1],
        "resolution_m": grid.resolution,
        "origin_x_m": grid.origin[0],
        "origin_y_m": grid.origin[1],
        "start_x_m": start and start.x,
        "start_y_m": start and start.y,
        "start_yaw_rad": start and start.yaw,
        "goal_x_m": goal and goal[0],
        "goal_y_m": goal and goal[1],
        "width_m": grid.width_m,
        "height_m": grid.height_m,
        "free_fraction": float(np.mean(~grid.cells)),
    }


def _world(row: dict[str, Any], file: Path) -> World:
    height, width = row["height_cells"], row["width_cells"]
    packed = np.frombuffer(row["cells"], dtype=np.uint8)
    if height < 1 or width < 1 or len(packed) != -(-height * width // 8):
        raise WorldError(
            f"{file} has {len(packed)} bytes of cells in world {row['world_id']}, "
            f"expected {height} x {width} cells"
        )
    cells = np.unpackbits(packed, count=height * width).reshape(height, width).astype(np.bool_)
    course = None
    if row["start_x_m"] is not None:
        start = Pose2D(row["start_x_m"], row["start_y_m"], row["start_yaw_rad"])
        course = (start, (row["goal_x_m"], row["goal_y_m"]))
    return World(
        world_id=row["world_id"],
        grid=OccupancyGrid(
            cells=cells,
            resolution=row["resolution_m"],
            origin=(row["origin_x_m"], row["origin_y_m"]),
        ),
        name=row["name"],
        source=row["source"],
        course=course,
    )
