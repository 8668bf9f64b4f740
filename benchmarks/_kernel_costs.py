"""What every kernel costs in running episodes, and what it would cost at the hardware's limit.

The limits are those of a core at 2 GHz, per unit of the work that was really there: units are
counted in the same episodes. Where the facts on performance have a limit, it is theirs.
"""

from collections.abc import Sequence
from unittest.mock import patch

import numpy as np
from _batch_ticks import SENSING_HZ, BatchSide
from _kernel_clock import STAGES, run_clocked

from ses_core.navigation import NavigationTask
from ses_core.planning import rollouts, trajectory_planner
from ses_core.planning.costmap import FAR_CELLS, WINDOW_SIZE
from ses_core.planning.distance_maps import BLOCKED
from ses_core.robot_profile import JACKAL

NS_PER_CELL_STEP = 2.4  # a laser ray enters a cell: 4 to 5 cycles that wait for each other
NS_PER_DRAW = 1.9  # 15 operations of a normal number, 4 at a time
NS_PER_MARKED_BEAM = 11.0  # marking a scan into a map, measured: 8 us for 720 beams
NS_PER_DISTANCE = 11_000.0 / 120**2  # exact distances: 25 minima per cell in 32 lanes
NS_PER_PLAN_POINT = 40.0  # 20 operations of 4 cycles that wait for each other
NS_PER_WAVE_CELL = 5.0  # 5 loads and 2 stores from the second-level cache
NS_PER_BYTE = 1.0 / 64.0  # 32 bytes per cycle
NS_PER_SEARCHED_CELL = 1.25  # 4 loads, 4 comparisons, 2 stores: 5 loads and stores per 2 cycles
NS_PER_PLANNER_POINT = 0.6  # a point under the outline: 0.5 to 0.65
NS_MOTION = 200.0  # 2 arcs of 4 sines, and 2 draws

_COUNTED_TICKS = 4
_PLANNED_SLOTS = 20


def kernel_rows(
    tasks: Sequence[NavigationTask], *, ticks: int, rounds: int
) -> list[dict[str, str | float]]:
    """Give what a tick spends in every kernel, its limit, and how far the two are apart.

    Every round drives the same episodes; of each stage in each slot the quickest round counts.
    """
    side = BatchSide(tasks, profile=JACKAL, sensing_hz=SENSING_HZ)
    simulator = side.simulator
    spent = np.full((len(tasks), len(STAGES)), np.iinfo(np.int64).max)
    for _ in range(rounds):
        side.start()
        before = simulator.state().times.sum()
        this = np.zeros_like(spent)
        run_clocked(
            simulator._slots,
            simulator._memory,
            simulator._robot,
            simulator._setup,
            simulator._scratch,
            side.parameters,
            ticks,
            this,
        )
        spent = np.minimum(spent, this)
    clocked = simulator.state()
    driven = round((clocked.times.sum() - before) / simulator.time_step)
    side.start()
    simulator.advance(side.parameters, ticks)
    if not np.array_equal(simulator.state().poses, clocked.poses):
        raise RuntimeError("found other poses with a clock between the kernels, expected the same")
    limits = _limits_ns(side, ticks)
    simulator.close()
    rows = [
        _row(f"kernel: {name}", cost / driven, limit)
        for name, cost, limit in zip(STAGES, spent.sum(axis=0).tolist(), limits, strict=True)
    ]
    costliest = max(rows, key=lambda row: row["ours"])
    return [*rows, {**costliest, "name": f"costliest {costliest['name']}"}]


def _row(name: str, cost_ns: float, limit_ns: float) -> dict[str, str | float]:
    return {
        "name": name,
        "unit": "us/tick",
        "ours": round(cost_ns / 1000.0, 2),
        "theirs": round(limit_ns / 1000.0, 2),
        "ratio": round(cost_ns / limit_ns, 2),
    }


def _limits_ns(side: BatchSide, ticks: int) -> list[float]:
    """Count a tick's work on a few ticks of all slots, and price it."""
    side.start()
    every = max(ticks // _COUNTED_TICKS, 1)
    prices = []
    for _ in range(_COUNTED_TICKS):
        side.simulator.advance(side.parameters, every)
        planned = _planner_points(side)
        prices += [_price(side, number, planned) for number in range(side.simulator.slots)]
    limits: list[float] = np.mean(prices, axis=0).tolist()
    return limits


def _price(side: BatchSide, number: int, planner_points: float) -> list[float]:
    """Price [ns] the last tick of a slot, in the order of the stages."""
    simulator = side.simulator
    slot, memory, robot = simulator._slots[number], simulator._memory, simulator._robot
    ranges = memory.scans[number]
    turn = np.array([np.cos(slot["yaw"]), np.sin(slot["yaw"])])
    along_x = turn[0] * robot.beams[:, 0] - turn[1] * robot.beams[:, 1]
    along_y = turn[1] * robot.beams[:, 0] + turn[0] * robot.beams[:, 1]
    has_hit = np.isfinite(ranges)
    crossed = ((np.abs(along_x) + np.abs(along_y)) * ranges)[has_hit].sum()
    # What a scan has changed lies within its marks: all that is nearer than 2.5 m.
    near = has_hit & (ranges < 2.5)
    sides = [
        np.ptp(direction[near] * ranges[near]) / 0.05 + 2 * FAR_CELLS if near.any() else 0.0
        for direction in (along_x, along_y)
    ]
    area = min(sides[0], slot["map_width"]) * min(sides[1], slot["map_height"])
    size = int(slot["map_width"] * slot["map_height"])
    first = int(slot["map_offset"])
    waves = np.count_nonzero(memory.potential[first : first + size] < 1e10)
    searched = sum(
        np.count_nonzero(steps[number] < BLOCKED)
        for steps in (memory.path_steps, memory.goal_steps)
    )
    window = WINDOW_SIZE**2
    return [
        NS_PER_CELL_STEP * crossed / slot["world_resolution"],
        NS_PER_DRAW * len(ranges),
        NS_PER_MARKED_BEAM * len(ranges),
        NS_PER_DISTANCE * area,
        # The potential holds for two seconds.
        NS_PER_PLAN_POINT * slot["plan_size"] + NS_PER_WAVE_CELL * waves / 40.0,
        NS_PER_BYTE * 2 * window,
        NS_PER_SEARCHED_CELL * searched + NS_PER_BYTE * 5 * window,
        NS_PER_PLANNER_POINT * planner_points,
        NS_MOTION,
    ]


def _planner_points(side: BatchSide) -> float:
    """Count the points under outline and centre that a tick's samples look at, on average.

    The planner's own Python is run for it, on copies of some slots.
    """
    simulator = side.simulator
    slots = simulator._slots[:_PLANNED_SLOTS].copy().view(np.recarray)
    points, looks = len(simulator._robot.outline) + 1, []
    pose_cost, rollout_cost = rollouts._pose_cost, rollouts.rollout_cost.py_func

    def counted(*arguments: object) -> float:
        looks.append(points)
        return pose_cost(*arguments)

    with (
        patch.object(rollouts, "_pose_cost", counted),
        patch.multiple(
            trajectory_planner,
            rollout_cost=rollout_cost,
            _best_forward=trajectory_planner._best_forward.py_func,
            _prefer_turning=trajectory_planner._prefer_turning.py_func,
        ),
    ):
        for number, slot in enumerate(slots):
            trajectory_planner.find_command.py_func(
                slot,
                simulator._memory,
                number,
                simulator._robot,
                side.parameters[number],
                simulator.time_step,
                simulator._scratch,
                0,
            )
    return sum(looks) / len(slots)
