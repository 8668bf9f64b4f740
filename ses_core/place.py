"""`Place`: an environment or a world as other tools know one, a map in metres."""

from dataclasses import dataclass

import numpy as np

from ses_core.arrays import BoolArray
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationEnvironment, World, environment_task
from ses_core.occupancy import ENVIRONMENT_SIDE_M, OccupancyGrid, environment_to_grid


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A map with what was seen of it, and where to drive from and to.

    Attributes:
        identity: Of the environment or world.
        grid: What is occupied; an environment lies in the frame of its scenario: the start is
            the origin, x leads to the goal.
        observed: (H, W), laid out like the grid's cells; True = seen or known.
        start: Where to begin, where that is fixed.
        goal: Where to drive to [m], where that is fixed.
    """

    identity: str
    grid: OccupancyGrid
    observed: BoolArray
    start: Pose2D | None = None
    goal: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.observed.shape != self.grid.cells.shape:
            raise ValueError(
                f"place has {self.observed.shape} observed cells, expected {self.grid.cells.shape}"
            )


def place_of_environment(environment: NavigationEnvironment) -> Place:
    """Lay an environment's own 30 x 30 cells out in the frame of its scenario."""
    return Place(
        identity=environment.environment_id,
        grid=environment_to_grid(environment.cells),
        observed=environment_to_grid(environment.observed).cells,
        start=Pose2D(0.0, 0.0),
        goal=(ENVIRONMENT_SIDE_M, 0.0),
    )


def course_of_environment(environment: NavigationEnvironment) -> Place:
    """Lay an environment out as policies are trained in it: sides closed, open aprons.

    Everything counts as observed: that is how it is driven.
    """
    task = environment_task(environment)
    return Place(
        identity=environment.environment_id,
        grid=task.world.grid,
        observed=np.ones_like(task.world.grid.cells),
        start=task.start,
        goal=task.goal,
    )


def place_of_world(world: World) -> Place:
    """Give a world's map in its own frame; all of it is known."""
    start, goal = world.course or (None, None)
    return Place(
        identity=world.world_id,
        grid=world.grid,
        observed=np.ones_like(world.grid.cells),
        start=start,
        goal=goal,
    )
