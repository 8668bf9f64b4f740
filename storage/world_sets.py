"""World sets: folders of `worlds.parquet` and a preview, and whatever else holds worlds."""

import csv
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ses_core.errors import NotAMapError, WorldError
from ses_core.navigation import World
from ses_core.worlds.grids import require_together
from storage.durable_files import replace_file, sync_file, sync_folder, temporary_name
from storage.world_archives import is_archive
from storage.world_files import IMAGE_SUFFIXES, MAP_SUFFIXES, named_picture
from storage.world_sources import (
    FOLDER_SUFFIXES,
    Paths,
    Reading,
    natural_order,
    read_archive,
    read_world_file,
    require_resolution,
)
from storage.world_tables import write_world_table

WORLDS_FILE = "worlds.parquet"
PREVIEW_FILE = "preview.png"
SPLIT_FILE = "split.csv"


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldsFound:
    """What some paths hold.

    Attributes:
        worlds: Each once, however often it was found.
        passed_over: Files that are no maps.
        refused: Why maps in folders and archives cannot be used, a line each.
    """

    worlds: tuple[World, ...]
    passed_over: tuple[Path, ...]
    refused: tuple[str, ...]


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
    write_world_table(temporary, worlds)
    sync_file(temporary)
    temporary.replace(target)
    sync_folder(directory)
    replace_file(directory / PREVIEW_FILE, world_sheet(worlds))


def read_worlds(
    paths: Sequence[Path], *, part: str | None = None, resolution: float | None = None
) -> list[World]:
    """Read all worlds of some paths, as `find_worlds`; a map that cannot be used is an error."""
    found = find_worlds(paths, part=part, reading=Reading(resolution=resolution))
    if found.refused:
        raise WorldError(found.refused[0])
    return list(found.worlds)


def find_worlds(
    paths: Sequence[Path], *, part: str | None = None, reading: Reading | None = None
) -> WorldsFound:
    """Read all worlds of some paths: world sets, files of any kind, or folders of these.

    In a folder or archive, what is no map is passed over and what cannot be used is refused;
    a file that is named must be one. The same world found twice counts once.

    Args:
        paths: Files and folders, read in this order, folders by file name, numbers in it by value.
        part: Only the worlds that the folder's `split.csv` puts into this part.
        reading: What the files themselves leave open.

    Raises:
        WorldError: A path is missing, a named file cannot be read, or nothing is found.
    """
    search = _Search(reading or Reading())
    for path in paths:
        if not path.exists():
            raise WorldError(f"{path} is missing, expected worlds")
        if path.is_dir():
            for file in _folder_files(path, part=part, passed_over=search.passed_over):
                search.look_into(file)
        else:
            search.take(path)
    if not search.worlds:
        if search.refused:
            raise WorldError(search.refused[0])
        where = ", ".join(map(str, paths))
        raise WorldError(
            f"no world in {where} ({len(search.passed_over)} files that are no maps), expected a "
            "world set, maps (yaml, png, pgm), .world files, meshes or logs with a map"
        )
    return WorldsFound(
        worlds=tuple(search.worlds.values()),
        passed_over=tuple(search.passed_over),
        refused=tuple(search.refused),
    )


@dataclass(slots=True)
class _Search:
    reading: Reading
    worlds: dict[str, World] = field(default_factory=dict)
    passed_over: list[Path] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    cells: int = 0
    paths: dict[Path, Paths] = field(default_factory=dict)

    def take(self, file: Path) -> None:
        """Read a file that must hold worlds."""
        if is_archive(file):
            archive = read_archive(file, self.reading)
            self._add(archive.worlds)
            self.passed_over += archive.passed_over
            self.refused += archive.refused
        else:
            self._add(read_world_file(file, self.reading, known_paths=self.paths))

    def look_into(self, file: Path) -> None:
        """Read a file that lies in a folder."""
        require_resolution(file, self.reading)
        try:
            worlds = read_world_file(file, self.reading, known_paths=self.paths)
        except NotAMapError:
            self.passed_over.append(file)
        except WorldError as error:
            self.refused.append(str(error))
        else:
            self._add(worlds)

    def _add(self, worlds: Sequence[World]) -> None:
        for world in worlds:
            if world.world_id not in self.worlds:
                self.worlds[world.world_id] = world
                self.cells += world.grid.cells.size
        require_together(self.cells)


def _folder_files(path: Path, *, part: str | None, passed_over: list[Path]) -> Iterator[Path]:
    """List the files of a folder to read, noting those that are no maps."""
    if (path / WORLDS_FILE).is_file() and part is None:
        yield path / WORLDS_FILE
        return
    files = sorted(
        (file for file in path.iterdir() if file.is_file()),
        key=lambda file: natural_order(file.name),
    )
    maps = [file for file in files if file.suffix.lower() in MAP_SUFFIXES]
    described = {_plain(picture) for file in maps if (picture := named_picture(file)) is not None}
    chosen = _names_of_part(path, part) if part is not None else None
    for file in files:
        suffix = file.suffix.lower()
        is_described = suffix in IMAGE_SUFFIXES and _plain(file) in described
        if file.name == SPLIT_FILE or is_described:
            continue
        if suffix not in FOLDER_SUFFIXES:
            passed_over.append(file)
        elif chosen is None or file.stem in chosen:
            yield file


def _plain(path: Path) -> str:
    """Write a path without detours; the disk is not asked, as a name may be any text."""
    return os.path.abspath(path)  # noqa: PTH100


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
