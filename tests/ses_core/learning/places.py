"""Small worlds to learn and to be measured in."""

import numpy as np

from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid


def corridor(name: str = "corridor", *, length: float = 4.0) -> NavigationTask:
    """An open corridor, 3 m wide; the goal is reached after `length` less 1 m."""
    cells = np.zeros((20, round((length + 3.0) / 0.15)), dtype=np.bool_)
    cells[[0, -1]] = True
    cells[:, [0, -1]] = True
    return NavigationTask(
        world=World(world_id=name, grid=OccupancyGrid(cells=cells, resolution=0.15)),
        start=Pose2D(1.0, 1.5, 0.0),
        goal=(1.0 + length, 1.5),
    )


def closed_room(name: str = "closed") -> NavigationTask:
    """A room that nobody gets out of; the goal lies behind its wall."""
    task = corridor(name, length=5.0)
    cells = task.world.grid.cells.copy()
    cells[:, 20] = True
    return NavigationTask(
        world=World(world_id=name, grid=OccupancyGrid(cells=cells, resolution=0.15)),
        start=task.start,
        goal=task.goal,
    )
