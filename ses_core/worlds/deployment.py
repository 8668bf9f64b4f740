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
from ses_core.learning.policies import observer_for, policy_ticks
from ses_core.navigation import NavigationTask
from ses_core.planning.parameters import initial_parameters
from ses_core.protocols import Policy, Simulator
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.factory import SimulatorName, make_simulator
from ses_core.simulation.trace import make_trace


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
    parameters = initial_parameters(simulator.slots, profile)
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
            parameters[slots] = initial_parameters(len(slots), profile)
        observations = observer.observe(simulator.scans(), simulator.state(), parameters)
        parameters = policy.act(observations)
        simulator.advance(parameters, ticks)
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
    """What the running deployments have done so far."""

    def __init__(self, simulator: Simulator, simulation: SimulationSettings, *, beams: int) -> None:
        self._simulator = simulator
        self._scan_every = max(1, round(simulation.control_rate_hz / simulation.sensing_rate_hz))
        self._scan_delay = resolve(simulation.imperfections).scan_delay_ticks
        self._trace = make_trace(
            simulator.slots,
            ticks=round(simulation.time_limit_s * simulation.control_rate_hz),
            sense_every=self._scan_every,
            beams=beams,
        )
        simulator.trace_into(self._trace)

    def deployment(self, slot: int, number: int, task: NavigationTask, seed: int) -> Deployment:
        """Copy what a finished slot has recorded."""
        state, trace, period = self._simulator.state(), self._trace, self._simulator.time_step
        steps = round(float(state.times[slot]) / period) + 1
        arrivals = np.arange(0, steps, self._scan_every)
        # What arrives before the first delay is over shows the start once more.
        is_new = (arrivals == 0) | (arrivals > self._scan_delay)
        return Deployment(
            number=number,
            task=task,
            seed=seed,
            outcome=EpisodeOutcome(int(state.outcomes[slot])),
            times=np.arange(steps, dtype=np.float64) * period,
            poses=trace.poses[slot, :steps].copy(),
            odometry=_from_start(trace.odometry[slot, :steps]),
            measured=trace.velocities[slot, :steps].copy(),
            commands=trace.commands[slot, 1:steps].copy(),
            scan_steps=np.maximum(arrivals - self._scan_delay, 0)[is_new],
            ranges=trace.scans[slot, : len(arrivals)][is_new].copy(),
        )


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
