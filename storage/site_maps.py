"""Maps of whole sites, by setting: places are rebuilt from them where poses are in their frame."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ses_core.extraction.recording import RecordedMap
from ses_core.geometry import Pose2D
from ses_core.worlds.identity import content_digest
from storage.world_files import read_map_server


@dataclass(frozen=True, slots=True)
class SiteMap:
    """A site's map, and the digest that stands for it in recipes."""

    recorded: RecordedMap
    digest: str


def read_site_maps(files: Mapping[str, str]) -> dict[str, SiteMap]:
    """Read map_server files by site.

    Raises:
        WorldError: A file is missing or is no map.
    """
    maps = {}
    for site, file in sorted(files.items()):
        grid = read_map_server(Path(file)).grid
        recorded = RecordedMap(
            cells=grid.cells.astype(np.uint8),
            resolution=grid.resolution,
            origin=Pose2D(*grid.origin),
        )
        maps[site] = SiteMap(recorded, content_digest(grid))
    return maps
