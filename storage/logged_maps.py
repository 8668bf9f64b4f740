"""The `nav_msgs/OccupancyGrid` of a ROS log as a world."""

import shutil
import tempfile
from pathlib import Path
from typing import Final

from ses_core.errors import LogError, NotAMapError, WorldError
from ses_core.navigation import World
from ses_core.settings import DecoderLimits
from ses_core.worlds.grids import coarsened, cut_to_free, levelled
from ses_core.worlds.identity import named_world
from storage.log_decoder import decode_map
from storage.log_formats import SUFFIXES, detect_format
from storage.world_files import first_line, named_errors

LOG_SUFFIXES: Final = frozenset(SUFFIXES.values())

_FREE = 0


def read_logged_map(path: Path) -> World:
    """Read the latest map of a `.bag`, `.db3` or `.mcap` file, in the frame of the map.

    Raises:
        NotAMapError: The log has no map.
        WorldError: It cannot be read.
    """
    try:
        found = detect_format(path)
    except OSError as error:
        raise WorldError(f"{path} cannot be read: {first_line(error)}") from error
    if found not in SUFFIXES:
        raise WorldError(f"{path} is no ROS log, expected the first bytes of a bag, db3 or mcap")
    with tempfile.TemporaryDirectory(prefix="ses-map-") as folder:
        try:
            recorded = decode_map(
                _private_name(path, Path(folder) / f"log{SUFFIXES[found]}"),
                format=found,
                limits=DecoderLimits(),
                workdir=Path(folder),
            )
        except OSError as error:
            raise WorldError(f"{path} cannot be read: {first_line(error)}") from error
        except LogError as error:
            kind = NotAMapError if error.reason == "missing_topic" else WorldError
            raise kind(f"{path} gives no map: {error}, expected one on a topic /map") from error
    with named_errors(path):
        grid = levelled(recorded.cells != _FREE, recorded.resolution, recorded.origin)
        return named_world(path.stem, cut_to_free(coarsened(grid)), source="log")


def _private_name(path: Path, name: Path) -> Path:
    """Give a log a name of our own: SQLite would read options out of one with a question mark."""
    write_ahead = path.with_name(f"{path.name}-wal")
    if write_ahead.exists():
        # What a killed recorder left is moved into the database: not into the user's.
        shutil.copyfile(path, name)
        shutil.copyfile(write_ahead, name.with_name(f"{name.name}-wal"))
    else:
        name.symlink_to(path.absolute())
    return name
