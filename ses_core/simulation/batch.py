"""`BatchSimulator`: many robots in many worlds at once, whole control ticks in compiled code."""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numba
import numpy as np

from ses_core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.imperfections import Imperfections, resolve
from ses_core.navigation import NavigationTask
from ses_core.planning.costmap import (
    FAR_CELLS,
    OBSTACLE_RANGE_M,
    RAYTRACE_RANGE_M,
    RESOLUTION_M,
    WINDOW_SIZE,
)
from ses_core.planning.global_planner import PLAN_CAPACITY, SEARCH_EVERY
from ses_core.planning.parameters import PARAMETER_NAMES
from ses_core.planning.potential import BUCKETS, UNREACHED
from ses_core.planning.trajectory_planner import MAX_VTHETA_SAMPLES, MAX_VX_SAMPLES
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.conditions import conditions
from ses_core.simulation.episode_start import draw_start
from ses_core.simulation.robot import robot_model
from ses_core.simulation.state import SLOT_DTYPE, BatchState, Memory, Scratch, snapshot
from ses_core.simulation.tick import ADVANCE, PLAN, SENSE, SETTLE, Outside, run_share
from ses_core.simulation.trace import NO_TRACE, Trace
from ses_core.simulation.world_pool import WorldPool, describe_world, known_map

_GROWTH = 2
"""A slot whose map has become too large gets this many times its room, if any world wants it."""

_NO_PARAMETERS = np.zeros((0, len(PARAMETER_NAMES)))

_SCAN_CELLS = math.ceil(2.0 * max(OBSTACLE_RANGE_M, RAYTRACE_RANGE_M) / RESOLUTION_M) + 4
_STALE_CELLS = _SCAN_CELLS + 2 * FAR_CELLS  # edge of what one scan can make stale


@dataclass(frozen=True, slots=True, kw_only=True)
class CostmapView:
    """A robot's whole map for a picture: costs (H, W) from 0 to 254, lower left corner [m]."""

    costs: Float32Array
    origin: tuple[float, float]
    resolution: float


class BatchSimulator:
    """Simulates N robots under the navigation stack; see `ses_core.protocols.Simulator`.

    Every slot has its own random state and touches only its own memory: the same task and seed
    give the same bytes whatever the other slots, their number, or the number of threads.
    For motion by somebody else's physics use `plan_commands` and `settle` instead of `advance`.
    """

    def __init__(self, *, slots: int, profile: RobotProfile, settings: SimulationSettings) -> None:
        if slots < 1:
            raise ValueError(f"simulator has {slots} slots, expected at least 1")
        threads = min(numba.get_num_threads(), slots)
        self._profile = profile
        self._levels = resolve(settings.imperfections)
        self._is_map_known = settings.known_map
        self._robot = robot_model(profile)
        self._setup = conditions(settings)
        self._slots = np.zeros(slots, dtype=SLOT_DTYPE)
        # A slot without an episode is not running.
        self._slots["outcome"] = EpisodeOutcome.TIMEOUT
        self._pool = WorldPool()
        self._world_keys = [0] * slots
        self._map_sizes = np.ones(slots, dtype=np.int64)
        self._memory = _memory(slots, beams=profile.laser.beams, levels=self._levels, cells=slots)
        self._threads = ThreadPoolExecutor(max_workers=threads, thread_name_prefix="simulator")
        self._scratch = _scratch(threads=threads, largest_map=1)
        self._trace = NO_TRACE
        self._outside = Outside(
            commands=np.zeros((0, 2)),
            poses=np.zeros((0, 3)),
            velocities=np.zeros((0, 2)),
            chosen=np.zeros(0, dtype=np.bool_),
        )

    @property
    def slots(self) -> int:
        """N, the number of robots stepped together."""
        return len(self._slots)

    @property
    def time_step(self) -> float:
        """Duration of one control tick [s]."""
        return self._setup.period

    def reset(self, slots: IntArray, tasks: Sequence[NavigationTask], seeds: IntArray) -> None:
        """Start an episode in each of the slots (S,) from tasks and noise seeds (S,).

        Raises:
            ValueError: Numbers of slots, tasks and seeds differ, or a slot does not exist.
        """
        if not len(slots) == len(tasks) == len(seeds):
            raise ValueError(
                f"reset of {len(slots)} slots got {len(tasks)} tasks and {len(seeds)} seeds, "
                "expected as many of each"
            )
        if len(slots) and (min(slots) < 0 or max(slots) >= self.slots):
            raise ValueError(f"reset of slot {max(slots)}, expected 0 to {self.slots - 1}")
        for number, task, seed in zip(slots, tasks, seeds, strict=True):
            self._start(int(number), task, int(seed))
        self._place_worlds(tasks)
        self._place_maps()
        chosen = np.zeros(self.slots, dtype=np.bool_)
        chosen[slots] = True
        for number, task in zip(slots, tasks, strict=True):
            self._clear_memory(int(number), task)
        self._run(SENSE, self._outside._replace(chosen=chosen))

    def advance(self, parameters: FloatArray, ticks: int) -> None:
        """Run control ticks under planner parameters (N, 8)."""
        self._run(ADVANCE, self._outside, parameters=self._checked(parameters), ticks=ticks)

    def trace_into(self, trace: Trace) -> None:
        """Write every tick from now on into arrays of N slots, as long as an episode lasts.

        Raises:
            ValueError: Slots, beams or number of scans do not fit.
        """
        rows = trace.poses.shape[1]
        scans = (rows - 1) // self._setup.sense_every + 1
        expected = (self.slots, scans, self._memory.scans.shape[1])
        if trace.scans.shape != expected or len(trace.poses) != self.slots:
            raise ValueError(
                f"trace of {rows} rows has scans of shape {trace.scans.shape}, expected {expected}"
            )
        self._trace = trace

    def plan_commands(self, parameters: FloatArray) -> FloatArray:
        """Plan one tick; give what reaches the wheels now (N, 2) [m/s, rad/s], 0 where finished."""
        commands = np.zeros((self.slots, 2))
        self._run(
            PLAN,
            self._outside._replace(commands=commands),
            parameters=self._checked(parameters),
        )
        return commands

    def settle(self, poses: FloatArray, velocities: FloatArray, contacts: BoolArray) -> None:
        """End a tick begun by `plan_commands` with poses (N, 3), velocities (N, 2), contacts (N,).

        Finished slots are left alone; outcomes, counts and due scans follow as in `advance`.
        """
        self._run(
            SETTLE,
            self._outside._replace(
                poses=np.ascontiguousarray(poses, dtype=np.float64),
                velocities=np.ascontiguousarray(velocities, dtype=np.float64),
                chosen=np.ascontiguousarray(contacts, dtype=np.bool_),
            ),
        )

    def scans(self) -> Float32Array:
        """Give the newest scan (N, B) [m] of every slot, inf where nothing was hit."""
        return self._memory.scans.copy()

    def state(self) -> BatchState:
        """Give a copy of every slot's state."""
        return snapshot(self._slots, time_step=self.time_step)

    def costmap(self, number: int) -> CostmapView:
        """Give the map one slot has built, under its inflation radius."""
        slot = self._slots[number]
        first, shape = int(slot["map_offset"]), (int(slot["map_height"]), int(slot["map_width"]))
        distances = self._memory.distances[first : first + shape[0] * shape[1]].reshape(shape)
        return CostmapView(
            costs=self._memory.costs[number][distances],
            origin=(float(slot["map_x"]), float(slot["map_y"])),
            resolution=RESOLUTION_M,
        )

    def plan(self, number: int) -> FloatArray:
        """Give one slot's global plan (P, 2) [m] as far as the local planner sees it."""
        slot = self._slots[number]
        cells = self._memory.plans[number, : int(slot["plan_size"])].astype(np.float64)
        return np.array([slot["map_x"], slot["map_y"]]) + RESOLUTION_M * cells

    def close(self) -> None:
        """End the threads."""
        self._threads.shutdown()

    def _run(
        self,
        phase: int,
        outside: Outside,
        *,
        parameters: FloatArray = _NO_PARAMETERS,
        ticks: int = 1,
    ) -> None:
        """Run a phase, every thread its share of the slots; the kernel holds no lock."""
        workers = min(len(self._scratch.queue), self.slots)

        def run(worker: int) -> None:
            run_share(
                phase,
                worker,
                workers,
                self._slots,
                self._memory,
                self._robot,
                self._setup,
                self._scratch,
                parameters,
                ticks,
                outside,
                self._trace,
            )

        list(self._threads.map(run, range(workers)))

    def _checked(self, parameters: FloatArray) -> FloatArray:
        expected = (self.slots, len(PARAMETER_NAMES))
        if parameters.shape != expected:
            raise ValueError(f"parameters have shape {parameters.shape}, expected {expected}")
        return np.ascontiguousarray(parameters, dtype=np.float64)

    def _start(self, number: int, task: NavigationTask, seed: int) -> None:
        """Write the record of a new episode; where its grids lie follows."""
        slot = self._slots[number]
        map_offset = int(slot["map_offset"])
        self._slots[number] = np.zeros((), dtype=SLOT_DTYPE)
        slot["map_offset"] = map_offset
        sequence = np.random.SeedSequence(seed)
        start = draw_start(
            task, profile=self._profile, levels=self._levels, rng=np.random.default_rng(sequence)
        )
        for name in ("", "true_", "odometry_"):
            slot[f"{name}x"], slot[f"{name}y"] = start.pose.x, start.pose.y
            slot[f"{name}yaw"] = start.pose.yaw
        for name in ("anchor", "oscillation", "escape"):
            slot[f"{name}_x"], slot[f"{name}_y"] = start.pose.x, start.pose.y
        slot["turn_gain"], slot["way_gain"] = start.turn_gain, start.way_gain
        slot["odometry_gain"] = start.odometry_gain
        slot["goal_x"], slot["goal_y"] = task.goal
        slot["local_goal_x"], slot["local_goal_y"] = task.goal
        slot["random_state"] = sequence.generate_state(1, np.uint64)[0]
        slot["search_needed"], slot["search_tick"] = True, -SEARCH_EVERY
        slot["inflation_radius"] = -1.0
        slot["outcome"] = EpisodeOutcome.RUNNING
        describe_world(slot, task.world.grid)
        slot["reached_right"], slot["reached_top"] = -1, -1
        slot["changed_left"], slot["changed_right"] = slot["map_width"], -1
        slot["changed_bottom"], slot["changed_top"] = slot["map_height"], -1
        self._world_keys[number] = id(task.world.grid.cells)

    def _place_worlds(self, tasks: Sequence[NavigationTask]) -> None:
        self._pool.hold([task.world.grid for task in tasks], set(self._world_keys))
        self._memory = self._memory._replace(clearance=self._pool.flat)
        self._slots["world_offset"] = [self._pool.offsets.get(key, 0) for key in self._world_keys]

    def _place_maps(self) -> None:
        """Give every slot room for its map; what others have seen moves with them."""
        sizes = self._slots["map_width"] * self._slots["map_height"]
        too_small = sizes > self._map_sizes
        if not too_small.any():
            return
        old = self._memory
        before = self._slots["map_offset"].copy()
        kept = self._map_sizes
        # Room to grow: moving all maps for every larger world took a tenth of a fleet's day.
        grown = np.minimum(_GROWTH * kept, sizes.max())
        self._map_sizes = np.where(too_small, np.maximum(grown, sizes), kept)
        self._slots["map_offset"] = np.concatenate(([0], np.cumsum(self._map_sizes)[:-1]))
        total = int(self._map_sizes.sum())
        self._memory = old._replace(
            marks=np.zeros(total, dtype=np.uint8),
            distances=np.zeros(total, dtype=np.uint8),
            potential=np.zeros(total, dtype=np.float32),
        )
        for name in ("marks", "distances", "potential"):
            source, target = getattr(old, name), getattr(self._memory, name)
            for first, into, size in zip(before, self._slots["map_offset"], kept, strict=True):
                target[into : into + size] = source[first : first + size]
        largest = int(self._map_sizes.max())
        if largest > self._scratch.bucket_of.shape[1]:
            threads = len(self._scratch.queue)
            self._scratch = _scratch(threads=threads, largest_map=largest)

    def _clear_memory(self, number: int, task: NavigationTask) -> None:
        """Forget what the last episode in a slot had seen; begin with the map if it is known."""
        first, size = int(self._slots["map_offset"][number]), int(self._map_sizes[number])
        self._memory.marks[first : first + size] = 0
        self._memory.distances[first : first + size] = 255
        self._memory.potential[first : first + size] = UNREACHED
        self._memory.costs[number] = 0.0
        self._memory.delayed[number] = 0.0
        if self._is_map_known:
            marks, distances = known_map(self._slots[number], task.world.grid)
            self._memory.marks[first : first + marks.size] = marks.ravel()
            self._memory.distances[first : first + marks.size] = distances.ravel()


def _memory(slots: int, *, beams: int, levels: Imperfections, cells: int) -> Memory:
    window = (slots, WINDOW_SIZE, WINDOW_SIZE)
    return Memory(
        clearance=np.zeros(1, dtype=np.uint8),
        marks=np.zeros(cells, dtype=np.uint8),
        distances=np.zeros(cells, dtype=np.uint8),
        potential=np.zeros(cells, dtype=np.float32),
        plans=np.zeros((slots, PLAN_CAPACITY, 2), dtype=np.float32),
        costs=np.zeros((slots, 256), dtype=np.float32),
        window_distances=np.zeros(window, dtype=np.uint8),
        path_steps=np.zeros(window, dtype=np.uint16),
        goal_steps=np.zeros(window, dtype=np.uint16),
        delayed=np.zeros((slots, levels.command_delay_ticks + 1, 2)),
        scans=np.full((slots, beams), np.inf, dtype=np.float32),
        past_poses=np.zeros((slots, levels.scan_delay_ticks + 1, 6)),
    )


def _scratch(*, threads: int, largest_map: int) -> Scratch:
    return Scratch(
        queue=np.zeros((threads, WINDOW_SIZE * WINDOW_SIZE), dtype=np.int32),
        columns=np.zeros((threads, _STALE_CELLS + 1, _STALE_CELLS + 2 * FAR_CELLS), dtype=np.int16),
        bucket_ends=np.full((threads, BUCKETS, 2), -1, dtype=np.int32),
        links=np.zeros((threads, largest_map, 2), dtype=np.int32),
        bucket_of=np.zeros((threads, largest_map), dtype=np.uint8),
        samples=np.zeros((threads, MAX_VX_SAMPLES * MAX_VTHETA_SAMPLES)),
    )
