"""Control ticks with a clock between the kernels: what each of them costs in running episodes.

The same kernels in the same order as `ses_core.simulation.tick`; whoever calls this checks that
the robots arrive at the same poses, so that the two cannot drift apart unnoticed.
"""

from typing import TYPE_CHECKING

import numpy as np
from numba.core import types
from numpy.typing import NDArray

from ses_core.arrays import FloatArray, IntArray
from ses_core.compilation import compiled
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.planning.costmap import centre_window, refresh_distances, work_in_scan
from ses_core.planning.distance_maps import measure_distances
from ses_core.planning.global_planner import update_plan
from ses_core.simulation.conditions import Conditions
from ses_core.simulation.motion import move
from ses_core.simulation.robot import RobotModel
from ses_core.simulation.sensing import spoil_scan, take_scan
from ses_core.simulation.tick import plan

if TYPE_CHECKING:
    from ses_core.simulation.state import Memory, Scratch, Slot

STAGES = (
    "lidar", "noise", "marks", "distances", "plan", "window", "local maps", "samples", "motion"
)  # fmt: skip
LIDAR, NOISE, MARKS, DISTANCES, PLAN, WINDOW, LOCAL_MAPS, SAMPLES, MOTION = range(len(STAGES))

_RUNNING = int(EpisodeOutcome.RUNNING)
_MONOTONIC = 1
# By its name in the C library, so that numba can cache what calls it.
_clock_gettime = types.ExternalFunction(
    "clock_gettime", types.int32(types.int32, types.CPointer(types.int64))
)


@compiled
def _nanoseconds(stamp: IntArray) -> int:
    _clock_gettime(_MONOTONIC, stamp.ctypes)
    return stamp[0] * 1_000_000_000 + stamp[1]


@compiled
def run_clocked(
    slots: NDArray[np.void],
    memory: "Memory",
    robot: RobotModel,
    setup: Conditions,
    scratch: "Scratch",
    parameters: FloatArray,
    ticks: int,
    spent: IntArray,
) -> None:
    """Run control ticks in every slot; add what each stage took (N, stages) [ns]."""
    stamp = np.zeros(2, dtype=np.int64)
    for number in range(slots.shape[0]):
        slot = slots[number]
        taken = spent[number]
        for _ in range(ticks):
            if slot.outcome != _RUNNING:
                break
            before = _nanoseconds(stamp)
            plan(slot, memory, number, robot, setup, parameters[number], scratch, 0)
            now = _nanoseconds(stamp)
            taken[SAMPLES] += now - before
            move(slot, memory, number, robot, setup)
            before = _nanoseconds(stamp)
            taken[MOTION] += before - now
            if slot.tick % setup.sense_every == 0:
                _sense_clocked(slot, memory, number, robot, setup, scratch, taken, stamp)


@compiled
def _sense_clocked(
    slot: "Slot",
    memory: "Memory",
    number: int,
    robot: RobotModel,
    setup: Conditions,
    scratch: "Scratch",
    taken: IntArray,
    stamp: IntArray,
) -> None:
    start = _nanoseconds(stamp)
    take_scan(slot, memory, number, robot, setup)
    end = _nanoseconds(stamp)
    taken[LIDAR] += end - start
    ranges = memory.scans[number]
    spoil_scan(slot, ranges, robot, setup)
    start = _nanoseconds(stamp)
    taken[NOISE] += start - end
    work_in_scan(
        slot, memory, ranges, robot, scratch.queue[0], clears_footprint=setup.clears_footprint
    )
    end = _nanoseconds(stamp)
    taken[MARKS] += end - start
    refresh_distances(slot, memory, scratch, 0)
    start = _nanoseconds(stamp)
    taken[DISTANCES] += start - end
    update_plan(slot, memory, number, scratch, 0, setup.plan_age)
    end = _nanoseconds(stamp)
    taken[PLAN] += end - start
    centre_window(slot, memory, number)
    start = _nanoseconds(stamp)
    taken[WINDOW] += start - end
    measure_distances(slot, memory, number, robot, scratch, 0)
    taken[LOCAL_MAPS] += _nanoseconds(stamp) - start
