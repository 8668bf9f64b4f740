"""Navigation environments, tasks and domains (section III-A)."""

from dataclasses import dataclass

import numpy as np

from ses_core.arrays import BoolArray
from ses_core.geometry import Pose2D
from ses_core.occupancy import (
    ENVIRONMENT_CELLS,
    ENVIRONMENT_SIDE_M,
    OccupancyGrid,
    environment_course,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationEnvironment:
    """A place *e*: what is occupied, what was seen, and where it came from.

    Attributes:
        cells: (30, 30), True = occupied; row 0 = goal edge, column 0 = left edge.
        observed: (30, 30), True = seen by a sensor or known from a map or a generator.
        origin: `scan` or `map` when reconstructed, else the name of the synthesizer.
        environment_id: Digest of origin, cells and the scenario it was made from.
        scenario_id: The scenario it was reconstructed from; empty for a synthesized one.
    """

    environment_id: str
    cells: BoolArray
    observed: BoolArray
    origin: str
    scenario_id: str = ""

    def __post_init__(self) -> None:
        expected = (ENVIRONMENT_CELLS, ENVIRONMENT_CELLS)
        if self.cells.shape != expected or self.observed.shape != expected:
            raise ValueError(
                f"environment has shapes {self.cells.shape} and {self.observed.shape}, "
                f"expected {expected} twice"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """A grid a robot drives in; what lies outside the grid counts as wall.

    Attributes:
        world_id: The name it has in tables and reports; unlike `name` it is unique.
        name: What its file or generator calls it.
        source: Where it came from, e.g. `barn` or `map`.
        course: Start pose and goal point, where the source fixes them (BARN does).
    """

    world_id: str
    grid: OccupancyGrid
    name: str = ""
    source: str = ""
    course: tuple[Pose2D, tuple[float, float]] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationTask:
    """*T* = (e, alpha, beta): drive from a start pose to within 1 m of a goal point [m]."""

    world: World
    start: Pose2D
    goal: tuple[float, float]


@dataclass(frozen=True, slots=True)
class NavigationDomain:
    """*p(T)*: the uniform distribution over a finite set of environments."""

    environments: tuple[NavigationEnvironment, ...]

    def cells(self) -> BoolArray:
        """Stack the cells of all environments: (N, 30, 30)."""
        if not self.environments:
            return np.zeros((0, ENVIRONMENT_CELLS, ENVIRONMENT_CELLS), dtype=np.bool_)
        return np.stack([environment.cells for environment in self.environments])


def environment_task(environment: NavigationEnvironment) -> NavigationTask:
    """Cross an environment: from the bottom middle, heading for the goal, to the top middle.

    The world is the environment with closed sides and 1 m of open apron at both ends, in the
    frame of its scenario: the start is its origin.
    """
    return NavigationTask(
        world=World(
            world_id=environment.environment_id, grid=environment_course(environment.cells)
        ),
        start=Pose2D(0.0, 0.0, 0.0),
        goal=(ENVIRONMENT_SIDE_M, 0.0),
    )
