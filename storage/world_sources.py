"""What kinds of files hold worlds, and the one place where a file's kind decides its reader."""

import io
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ses_core.arrays import IntArray
from ses_core.errors import NotAMapError, WorldError
from ses_core.navigation import World
from ses_core.worlds.grids import require_together, require_usable
from ses_core.worlds.identity import named_world
from ses_core.worlds.mesh_slicing import DEFAULT_SLICING, MeshSlicing
from storage.array_worlds import ARRAY_SUFFIX, read_array_world
from storage.barn_files import BarnCourse, barn_field, path_course, read_barn_array
from storage.gazebo_worlds import GAZEBO_SUFFIXES, RESOLUTION_M, read_gazebo_world
from storage.house_plans import PLAN_SUFFIXES, read_house_plan
from storage.logged_maps import LOG_SUFFIXES, read_logged_map
from storage.mesh_worlds import MESH_SUFFIXES, read_mesh
from storage.world_archives import archived_files
from storage.world_files import (
    IMAGE_SUFFIXES,
    LARGEST_FILE_MIB,
    MAP_SUFFIXES,
    first_line,
    read_image,
    read_map_server,
)
from storage.world_tables import TABLE_SUFFIX, read_world_table

BARN_ARRAY_SUFFIXES: Final = frozenset({".npy"})
_PATH_FOLDER: Final = "path_files"

_PACKABLE: Final = IMAGE_SUFFIXES | GAZEBO_SUFFIXES | PLAN_SUFFIXES | BARN_ARRAY_SUFFIXES
FOLDER_SUFFIXES: Final = _PACKABLE | MAP_SUFFIXES | MESH_SUFFIXES | LOG_SUFFIXES | {ARRAY_SUFFIX}
"""What is read of a folder; archives only where they are named, as they may lie there unpacked."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What files leave open.

    Attributes:
        resolution: Of images that carry none [m per pixel]; cells of what is made of solids.
        slicing: Heights at which meshes and Gazebo worlds are looked at.
        barn_course: Start and goal of BARN's worlds: the protocol's, or by their paths.
    """

    resolution: float | None = None
    slicing: MeshSlicing = DEFAULT_SLICING
    barn_course: BarnCourse = "protocol"

    def __post_init__(self) -> None:
        if self.resolution is not None:
            require_usable(self.resolution)


@dataclass(frozen=True, slots=True, kw_only=True)
class Archive:
    """What an archive held: worlds, what was no map, and why maps were refused."""

    worlds: tuple[World, ...]
    passed_over: tuple[Path, ...]
    refused: tuple[str, ...]


Paths = dict[int, IntArray]
"""BARN's paths by their numbers."""


def read_world_file(
    file: Path, reading: Reading, *, known_paths: dict[Path, Paths] | None = None
) -> list[World]:
    """Read the worlds of one file that is no archive.

    Args:
        file: File to read.
        reading: What it leaves open.
        known_paths: BARN's paths by folder, each read once by whoever keeps this for all files.

    Raises:
        NotAMapError: It holds something else.
        WorldError: It cannot be read.
    """
    suffix = file.suffix.lower()
    if suffix == TABLE_SUFFIX:
        return read_world_table(file)
    if suffix in MAP_SUFFIXES:
        return [read_map_server(file)]
    if suffix in MESH_SUFFIXES:
        resolution = reading.resolution or RESOLUTION_M
        return [read_mesh(file, slicing=reading.slicing, resolution=resolution)]
    if suffix in LOG_SUFFIXES:
        return [read_logged_map(file)]
    if suffix == ARRAY_SUFFIX:
        return [read_array_world(file)]
    if suffix in _PACKABLE:
        world = _read_content(file, _bytes(file), reading)
        known = {} if known_paths is None else known_paths
        return list(_with_courses([world], lambda: _paths_beside(file.parent, known), reading))
    raise NotAMapError(
        f"{file} is no map, expected a world set (worlds.parquet), yaml, an image, .world, "
        "an npz of `ses export`, a HouseExpo json, a BARN npy, a log (bag, db3, mcap), a mesh "
        "(glb, ply, obj, stl) or a tar archive of these"
    )


def read_archive(file: Path, reading: Reading) -> Archive:
    """Read the worlds of an archive, by number in their names.

    Raises:
        WorldError: The archive itself cannot be read.
    """
    worlds: list[World] = []
    passed_over: list[Path] = []
    refused: list[str] = []
    paths: Paths = {}
    cells = 0
    for name, content in archived_files(file):
        if name.suffix.lower() not in _PACKABLE:
            passed_over.append(name)
            continue
        require_resolution(name, reading)
        try:
            if (path := _barn_path(name, content)) is not None:
                paths[_number(name.stem)] = path
                passed_over.append(name)
            else:
                world = _read_content(name, content, reading)
                worlds.append(world)
                cells += world.grid.cells.size
        except NotAMapError:
            passed_over.append(name)
        except WorldError as error:
            refused.append(str(error))
        require_together(cells)
    worlds.sort(key=lambda world: natural_order(world.name))
    return Archive(
        worlds=tuple(_with_courses(worlds, lambda: paths, reading)),
        passed_over=tuple(passed_over),
        refused=tuple(refused),
    )


def require_resolution(file: Path, reading: Reading) -> None:
    """Refuse images without resolution: one line, not one for each picture of a folder."""
    if reading.resolution is None and file.suffix.lower() in IMAGE_SUFFIXES:
        raise WorldError(f"{file} carries no resolution, expected --resolution [m per pixel]")


def natural_order(name: str) -> list[tuple[int, str]]:
    """Sort `world_2` before `world_10`."""
    # A longer number is the larger one: no name is too long to become an int.
    return [
        (len(part.lstrip("0")), part.lstrip("0")) if part.isdecimal() else (-1, part)
        for part in re.split(r"(\d+)", name)
    ]


def _read_content(name: Path, content: bytes, reading: Reading) -> World:
    """Read one world from bytes, which may have come out of an archive."""
    suffix = name.suffix.lower()
    if suffix in IMAGE_SUFFIXES:
        require_resolution(name, reading)
        assert reading.resolution is not None
        return read_image(name, resolution=reading.resolution, content=io.BytesIO(content))
    if suffix in BARN_ARRAY_SUFFIXES:
        field = read_barn_array(name, content).field
        if field is None:
            raise NotAMapError(f"{name} is BARN's path, expected the world it goes through")
        return barn_field(name, field)
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise WorldError(f"{name} cannot be read as text: {first_line(error)}") from error
    if suffix in PLAN_SUFFIXES:
        return read_house_plan(name, text)
    return read_gazebo_world(
        name, text=text, resolution=reading.resolution or RESOLUTION_M, slicing=reading.slicing
    )


def _bytes(file: Path) -> bytes:
    try:
        if file.stat().st_size > LARGEST_FILE_MIB << 20:
            raise WorldError(f"{file} is larger than {LARGEST_FILE_MIB} MiB")
        return file.read_bytes()
    except OSError as error:
        raise WorldError(f"{file} cannot be read: {first_line(error)}") from error


def _barn_path(name: Path, content: bytes) -> IntArray | None:
    if name.suffix.lower() not in BARN_ARRAY_SUFFIXES:
        return None
    return read_barn_array(name, content).path


def _paths_beside(folder: Path, known: dict[Path, Paths]) -> Paths:
    """Read BARN's paths from a folder of worlds or its `path_files`, unless they are known."""
    if folder not in known:
        files = [*folder.glob("path_*.npy"), *(folder / _PATH_FOLDER).glob("path_*.npy")]
        paths = ((file, _barn_path(file, _bytes(file))) for file in files)
        known[folder] = {_number(file.stem): path for file, path in paths if path is not None}
    return known[folder]


def _with_courses(
    worlds: Iterable[World], paths: Callable[[], Paths], reading: Reading
) -> Iterator[World]:
    """Give BARN's worlds the start and goal of their paths, where that is asked for."""
    if reading.barn_course == "protocol":
        yield from worlds
        return
    known = paths()
    for world in worlds:
        if world.source != "barn":
            yield world
            continue
        number = _number(world.name)
        if number not in known:
            raise WorldError(
                f"{world.name} has no path, expected path_{max(number, 0)}.npy beside it"
            )
        course = path_course(known[number])
        yield named_world(world.name, world.grid, source=world.source, course=course)


def _number(name: str) -> int:
    """Give the number that a name ends in; -1 where it ends in none."""
    found = re.search(r"(?<!\d)(\d{1,18})$", name)
    return int(found[1]) if found else -1
