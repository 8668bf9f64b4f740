"""The same commands for two seconds in both simulators, and how far apart the robots end."""

from collections.abc import Iterator

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.batch import BatchSimulator
from ses_core.simulation.bullet import PHYSICS_RATE_HZ, PhysicalSlot
from ses_core.simulation.motion import move
from ses_core.simulation.rendering import render

TICKS = 40
_SUBSTEPS = 12
_RANDOM_DRIVES = 30
_OPEN_GROUND = OccupancyGrid(cells=np.zeros((200, 200), dtype=np.bool_), resolution=0.1)
_START = Pose2D(10.0, 10.0, 0.0)


def open_loop_errors(profile: RobotProfile) -> dict[str, FloatArray]:
    """Give the distances [m] after 2 s by kind of drive."""
    physical = PhysicalSlot(profile, time_step=1.0 / PHYSICS_RATE_HZ)
    errors: dict[str, list[float]] = {}
    for kind, commands in _drives():
        away = _kinematic(profile, commands) - _physical(physical, commands)
        errors.setdefault(kind, []).append(float(np.hypot(*away)))
    physical.close()
    return {kind: np.array(found) for kind, found in errors.items()}


def _drives() -> Iterator[tuple[str, FloatArray]]:
    """Commands (40, 2) [m/s, rad/s]; the random ones change every half second."""
    for v in (-0.5, 0.3, 0.5, 1.0):
        yield "straight", np.tile((v, 0.0), (TICKS, 1))
    for w in (-1.57, -0.8, -0.4, 0.4, 0.8, 1.57):
        yield "turn", np.tile((0.0, w), (TICKS, 1))
    for v in (0.3, 0.5, 1.0):
        for w in (-1.5, -0.8, -0.3, 0.3, 0.8, 1.5):
            yield "arc", np.tile((v, w), (TICKS, 1))
    rng = np.random.default_rng(0)
    for _ in range(_RANDOM_DRIVES):
        levels = rng.uniform((-0.5, -1.57), (1.0, 1.57), size=(TICKS // 10, 2))
        yield "random", np.repeat(levels, 10, axis=0)


def _kinematic(profile: RobotProfile, commands: FloatArray) -> FloatArray:
    settings = SimulationSettings(imperfections="clean")
    simulator = BatchSimulator(slots=1, profile=profile, settings=settings)
    task = NavigationTask(
        world=World(world_id="open ground", grid=_OPEN_GROUND), start=_START, goal=(19.0, 19.0)
    )
    simulator.reset(np.arange(1), [task], np.arange(1))
    for command in commands:
        simulator._memory.delayed[:] = command
        move(simulator._slots[0], simulator._memory, 0, simulator._robot, simulator._setup)
    end = simulator.state().poses[0, :2]
    simulator.close()
    return end


def _physical(slot: PhysicalSlot, commands: FloatArray) -> FloatArray:
    slot.build(render(_OPEN_GROUND), _START)
    for command in commands:
        slot.drive(command, substeps=_SUBSTEPS)
    return np.array(slot.pose()[:2])
