"""A simulated fleet at work: a policy drives from start to goal, and everything is recorded.

Steps are control ticks. Step k holds the pose at k ticks and the command under which the robot
drove on from there; scans arrive at steps that the sensing rate divides.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ses_core.arrays import Float32Array, FloatArray, IntArray
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.geometry import wrap_angles
from ses_core.imperfections import resolve
from ses_core.learning.policies import initial_parameters, observer_for, policy_ticks
from ses_core.navigation import NavigationTask
from ses_core.protocols import Policy, Simulator
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.factory import SimulatorName, make_simulator


@dataclass(frozen=True, slots=True, kw_only=True)
class Deployment:
    """One drive from start to goal, or to where it ended.

    Attributes:
        number: Its place among the tasks.
        times: (K,) [s] since the start.
        poses: (K, 3) [m, m, rad] true poses in the world.
        odometry: (K, 3) [m, m, rad] what the robot believes, from (0, 0, 0) and drifting.
        measured: (K, 2) [m/s, rad/s].
        commands: (K - 1, 2) [m/s, rad/s]; command k was given at step k.
        scan_steps: (S,) steps at which scans were taken, which is before they arrived.
        ranges: (S, B) [m], inf where nothing came back.
    """

    number: int
    task: NavigationTask
    seed: int
    outcome: EpisodeOutcome
    times: FloatArray
    poses: FloatArray
    odometry: FloatArray
    measured: FloatArray
    commands: FloatArray
    scan_steps: IntArray
    ranges: Float32Array


def deploy(
    tasks: Sequence[NavigationTask],
    policy: Policy,
    *,
    seed: int,
    simulation: SimulationSettings,
    profile: RobotProfile,
    simulator: SimulatorName = "batch",
    slots: int = 32,
    progress: Callable[[float], None] = lambda _: None,
) -> Iterator[Deployment]:
    """Drive every task once and give each deployment as soon as it ends.

    Task i is driven under a seed of its own, drawn from `seed` and i alone. Memory is bounded by
    the slots, about 1.5 MB each at 5 Hz of 720 beams, however many tasks there are.
    """
    if not tasks:
        return
    driver = make_simulator(
        simulator, slots=min(slots, len(tasks)), profile=profile, settings=simulation
    )
    try:
        yield from _drive_all(driver, tasks, policy, seed, simulation, profile, progress)
    finally:
        driver.close()


def _drive_all(
    simulator: Simulator,
    tasks: Sequence[NavigationTask],
    policy: Policy,
    seed: int,
    simulation: SimulationSettings,
    profile: RobotProfile,
    progress: Callable[[float], None],
) -> Iterator[Deployment]:
    observer = observer_for(policy, profile)
    ticks = policy_ticks(policy, simulator.time_step)
    recorder = _Recorder(simulator, simulation, beams=profile.laser.beams)
    parameters = initial_parameters(simulator.slots)
    waiting = deque(range(len(tasks)))
    driven = np.full(simulator.slots, -1)
    idle = np.arange(simulator.slots)
    done = 0
    while done < len(tasks):
        slots = idle[: len(waiting)]
        driven[idle] = -1
        driven[slots] = [waiting.popleft() for _ in slots]
        if len(slots):
            chosen = [tasks[number] for number in driven[slots]]
            seeds = [_task_seed(seed, number) for number in driven[slots].tolist()]
            simulator.reset(slots, chosen, np.array(seeds, dtype=np.int64))
            parameters[slots] = initial_parameters(len(slots))
            recorder.restart(slots)
        observations = observer.observe(simulator.scans(), simulator.state(), parameters)
        parameters = policy.act(observations)
        for _ in range(ticks):
            simulator.advance(parameters, 1)
            recorder.record()
        finished = (simulator.state().outcomes != EpisodeOutcome.RUNNING) & (driven >= 0)
        idle = np.flatnonzero(finished | (driven < 0))
        for slot in np.flatnonzero(finished).tolist():
            number = int(driven[slot])
            yield recorder.deployment(slot, number, tasks[number], _task_seed(seed, number))
            done += 1
        progress(done / len(tasks))


def _task_seed(seed: int, number: int) -> int:
    """Seed of one deployment: 31 bits."""
    return int(np.random.SeedSequence([seed, number]).generate_state(1)[0] >> 1)


class _Recorder:
    """What the running deployments have done so far, in arrays of a whole episode's length."""

    def __init__(self, simulator: Simulator, simulation: SimulationSettings, *, beams: int) -> None:
        self._simulator = simulator
        self._scan_every = max(1, round(simulation.control_rate_hz / simulation.sensing_rate_hz))
        steps = round(simulation.time_limit_s * simulation.control_rate_hz) + 1
        slots, scans = simulator.slots, (steps - 1) // self._scan_every + 1
        self._scan_delay = resolve(simulation.imperfections).scan_delay_ticks
        self._poses = np.zeros((slots, steps, 3))
        self._odometry = np.zeros((slots, steps, 3))
        self._measured = np.zeros((slots, steps, 2))
        self._commands = np.zeros((slots, steps, 2))
        self._ranges = np.zeros((slots, scans, beams), dtype=np.float32)
        self._steps = np.full(slots, -1)

    def restart(self, slots: IntArray) -> None:
        """Begin anew in these slots, with where they stand and what they see now."""
        self._steps[slots] = -1
        self._write(slots, np.zeros(len(slots), dtype=np.int64))

    def record(self) -> None:
        """Record a tick of every slot that has moved on by one."""
        ticks = np.rint(self._simulator.state().times / self._simulator.time_step).astype(np.int64)
        moved = np.flatnonzero((ticks > self._steps) & (self._steps >= 0))
        self._write(moved, ticks[moved])

    def deployment(self, slot: int, number: int, task: NavigationTask, seed: int) -> Deployment:
        """Copy what a finished slot has recorded."""
        last = int(self._steps[slot])
        arrivals = np.arange(0, last + 1, self._scan_every)
        # What arrives before the first delay is over shows the start once more.
        is_new = (arrivals == 0) | (arrivals > self._scan_delay)
        return Deployment(
            number=number,
            task=task,
            seed=seed,
            outcome=EpisodeOutcome(int(self._simulator.state().outcomes[slot])),
            times=np.arange(last + 1, dtype=np.float64) * self._simulator.time_step,
            poses=self._poses[slot, : last + 1].copy(),
            odometry=_from_start(self._odometry[slot, : last + 1]),
            measured=self._measured[slot, : last + 1].copy(),
            commands=self._commands[slot, :last].copy(),
            scan_steps=np.maximum(arrivals - self._scan_delay, 0)[is_new],
            ranges=self._ranges[slot, : len(arrivals)][is_new].copy(),
        )

    def _write(self, slots: IntArray, steps: IntArray) -> None:
        if not len(slots):
            return
        state = self._simulator.state()
        self._poses[slots, steps] = state.poses[slots]
        self._odometry[slots, steps] = state.odometry[slots]
        self._measured[slots, steps] = state.velocities[slots]
        later = steps > 0
        self._commands[slots[later], steps[later] - 1] = state.commands[slots[later]]
        self._steps[slots] = steps
        seeing = steps % self._scan_every == 0
        if seeing.any():
            scans = self._simulator.scans()
            self._ranges[slots[seeing], steps[seeing] // self._scan_every] = scans[slots[seeing]]


def _from_start(poses: FloatArray) -> FloatArray:
    """Give poses (K, 3) [m, m, rad] in the frame of the first: odometry begins at (0, 0, 0)."""
    away = poses - poses[0]
    cosine, sine = np.cos(poses[0, 2]), np.sin(poses[0, 2])
    return np.column_stack(
        (
            cosine * away[:, 0] + sine * away[:, 1],
            cosine * away[:, 1] - sine * away[:, 0],
            wrap_angles(away[:, 2]),
        )
    )
