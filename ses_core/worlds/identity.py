"""How a world gets its identity: its name, and a digest of what a robot meets in it."""

import numpy as np

from ses_core.geometry import Pose2D
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.recipes import canonical_json, digest_bytes


def named_world(
    name: str,
    grid: OccupancyGrid,
    *,
    source: str,
    course: tuple[Pose2D, tuple[float, float]] | None = None,
) -> World:
    """Make a world whose `world_id` is its name and 8 digits of the digest of its content.

    Equal content under another name keeps the digits, so that a held-out world which comes
    back among training worlds can be recognised by `content_digest`.
    """
    digest = content_digest(grid)
    return World(
        world_id=f"{name}-{digest[:8]}", grid=grid, name=name, source=source, course=course
    )


def content_digest(grid: OccupancyGrid) -> str:
    """Digest a map's cells, resolution and origin: 64 hexadecimal digits."""
    frame = canonical_json([*grid.cells.shape, grid.resolution, *grid.origin])
    return digest_bytes(frame.encode() + np.packbits(grid.cells).tobytes())
