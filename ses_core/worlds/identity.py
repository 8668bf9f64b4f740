"""How a world gets its identity: its name, and a digest of what a robot meets in it."""

import numpy as np

from ses_core.geometry import Pose2D
from ses_core.navigation import World
from ses_core.occupancy import OccupancyGrid
from ses_core.recipes import canonical_json, digest_bytes, digest_json

Course = tuple[Pose2D, tuple[float, float]]
"""Start and goal."""


def named_world(
    name: str,
    grid: OccupancyGrid,
    *,
    source: str,
    course: Course | None = None,
) -> World:
    """Make a world whose `world_id` is its name and 8 digits of its `world_digest`.

    The same world under another name keeps the digits. A held-out world which comes back among
    training worlds, on whatever course, is recognised by `content_digest`.
    """
    digest = world_digest(grid, course)
    return World(
        world_id=f"{name}-{digest[:8]}", grid=grid, name=name, source=source, course=course
    )


def world_digest(grid: OccupancyGrid, course: Course | None) -> str:
    """Digest a map and the one course to drive in it: without a course it is the map's digest."""
    content = content_digest(grid)
    if course is None:
        return content
    start, goal = course
    return digest_json([content, *map(float, (start.x, start.y, start.yaw, *goal))])


def content_digest(grid: OccupancyGrid) -> str:
    """Digest a map's cells, resolution and origin: 64 hexadecimal digits."""
    frame = canonical_json([*grid.cells.shape, grid.resolution, *grid.origin])
    return digest_bytes(frame.encode() + np.packbits(grid.cells).tobytes())
