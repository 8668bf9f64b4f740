"""What a control tick of the batch simulator costs."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np

from ses_core.arrays import Float32Array, FloatArray
from ses_core.navigation import NavigationTask
from ses_core.planning.parameters import DWA_SLOW
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.batch import BatchSimulator
from ses_core.simulation.lidar import cast_scan, chessboard_clearance
from ses_core.simulation.robot import robot_model

CONTROL_HZ = 20
SENSING_HZ = float(CONTROL_HZ)
"""A faithful tick senses every time; the default of the settings senses less often."""

WARM_TICKS = CONTROL_HZ
"""After a second maps and plans are those of a robot under way."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TickCost:
    """What a tick of one robot took [us]: time on the processors, and on the wall."""

    cpu: float
    wall: float


class BatchSide:
    """Drives every task from its start, again and again the same way."""

    def __init__(
        self,
        tasks: Sequence[NavigationTask],
        *,
        profile: RobotProfile,
        sensing_hz: float,
        threads: int = 1,
    ) -> None:
        # A simulator takes the number of threads that numba has when it is made.
        before = numba.get_num_threads()
        numba.set_num_threads(min(threads, before))
        self.simulator = BatchSimulator(
            slots=len(tasks),
            profile=profile,
            settings=SimulationSettings(sensing_rate_hz=sensing_hz, collisions_end=False),
        )
        numba.set_num_threads(before)
        self._tasks = list(tasks)
        self.parameters = np.tile(DWA_SLOW.as_array(), (len(tasks), 1))

    def start(self) -> None:
        """Put every robot at its start, and let it drive for a second."""
        slots = np.arange(len(self._tasks))
        self.simulator.reset(slots, self._tasks, slots)
        self.simulator.advance(self.parameters, WARM_TICKS)

    def cost(self, ticks: int) -> TickCost:
        """Measure ticks after the start; robots that arrive no longer count."""
        self.start()
        before = float(self.simulator.state().times.sum())
        cpu, wall = time.process_time(), time.perf_counter()
        self.simulator.advance(self.parameters, ticks)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        driven = (float(self.simulator.state().times.sum()) - before) * CONTROL_HZ
        return TickCost(cpu=1e6 * cpu / driven, wall=1e6 * wall / driven)

    def commands(self, ticks: int) -> FloatArray:
        """Record what the planner commands in every tick from the start on: (ticks, N, 2)."""
        slots = np.arange(len(self._tasks))
        self.simulator.reset(slots, self._tasks, slots)
        commands = np.zeros((ticks, len(slots), 2))
        for tick in range(ticks):
            self.simulator.advance(self.parameters, 1)
            commands[tick] = self.simulator.state().commands
        return commands


def true_scan(task: NavigationTask, pose: FloatArray, profile: RobotProfile) -> Float32Array:
    """Give the scan (B,) [m] without noise at a pose (3,), for comparison with others'."""
    grid, robot = task.world.grid, robot_model(profile)
    clearance = chessboard_clearance(np.pad(grid.cells, 1, constant_values=True))
    ranges = np.zeros(len(robot.beams), dtype=np.float32)
    height, width = clearance.shape
    cast_scan(
        ranges,
        clearance.ravel(),
        0,
        width,
        height,
        grid.resolution,
        pose[0] - grid.origin[0] + grid.resolution,
        pose[1] - grid.origin[1] + grid.resolution,
        pose[2],
        robot.beams,
        robot.range_min,
        robot.range_max,
    )
    return ranges
