"""Simulators, drawn worlds and kernel arguments that the tests of planning and simulation share."""

from dataclasses import dataclass
from typing import cast

import numpy as np

from ses_core.arrays import BoolArray, FloatArray
from ses_core.geometry import Pose2D
from ses_core.imperfections import PRESETS
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.planning.parameters import DWA_SLOW, PlannerParameters
from ses_core.robot_profile import JACKAL, RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.batch import BatchSimulator
from ses_core.simulation.conditions import Conditions
from ses_core.simulation.robot import RobotModel
from ses_core.simulation.state import Memory, Scratch, Slot

CLEAN = SimulationSettings(imperfections="clean")


def flawed(**levels: float) -> SimulationSettings:
    """Settings with these imperfections and no others."""
    return SimulationSettings(imperfections=PRESETS["clean"].model_copy(update=levels))


def hall(*, length: float = 9.0, width: float = 5.0, resolution: float = 0.1) -> BoolArray:
    """An empty hall with walls of one cell; the tests build obstacles into it."""
    cells = np.zeros((round(width / resolution), round(length / resolution)), dtype=np.bool_)
    cells[[0, -1], :] = True
    cells[:, [0, -1]] = True
    return cells


def course(
    cells: BoolArray,
    *,
    start: Pose2D | None = None,
    goal: tuple[float, float] = (8.0, 2.5),
    resolution: float = 0.1,
) -> NavigationTask:
    grid = OccupancyGrid(cells=cells, resolution=resolution)
    return NavigationTask(
        world=World(world_id="hall", grid=grid), start=start or Pose2D(1.0, 2.5, 0.0), goal=goal
    )


def parameters(slots: int, chosen: PlannerParameters = DWA_SLOW) -> FloatArray:
    return np.tile(chosen.as_array(), (slots, 1))


def simulator(
    *tasks: NavigationTask,
    settings: SimulationSettings = CLEAN,
    profile: RobotProfile = JACKAL,
    seed: int = 0,
) -> BatchSimulator:
    made = BatchSimulator(slots=len(tasks), profile=profile, settings=settings)
    numbers = np.arange(len(tasks))
    made.reset(numbers, tasks, numbers + seed)
    return made


def drive_out(driven: BatchSimulator, chosen: PlannerParameters = DWA_SLOW) -> None:
    """Drive until every episode has ended."""
    while np.any(driven.state().outcomes == 0):
        driven.advance(parameters(driven.slots, chosen), 20)


@dataclass(frozen=True, slots=True)
class Kernel:
    """What the kernels get of a simulator's first slot."""

    slot: Slot
    memory: Memory
    robot: RobotModel
    setup: Conditions
    scratch: Scratch


def kernel(driven: BatchSimulator) -> Kernel:
    return Kernel(
        cast("Slot", driven._slots[0]),
        driven._memory,
        driven._robot,
        driven._setup,
        driven._scratch,
    )


def planned(task: NavigationTask, chosen: PlannerParameters = DWA_SLOW) -> Kernel:
    """A robot that has sensed and planned its first tick, but not moved."""
    driven = simulator(task)
    driven.plan_commands(parameters(1, chosen))
    return kernel(driven)


def put(slot: Slot, **values: float) -> None:
    """Set fields of a record, which numpy only allows by name."""
    for name, value in values.items():
        cast("dict[str, float]", slot)[name] = value


def get(slot: Slot, name: str) -> float:
    return cast("dict[str, float]", slot)[name]
