"""An episode driven again and recorded: what the robot did, and what it saw at one moment.

A simulator gives the same bytes for the same task, seed, policy and settings: an episode of an
evaluation needs no recording of its own, it is driven a second time.
"""

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from itertools import islice

import numpy as np

from ses_core.arrays import BoolArray, Float32Array, FloatArray
from ses_core.evaluation.episodes import Episode
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.evaluation.trials import Trial, finished_episode
from ses_core.geometry import Pose2D, from_frame
from ses_core.learning.policies import observer_for, policy_ticks
from ses_core.planning.parameters import initial_parameters
from ses_core.protocols import Policy, Simulator
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.factory import SimulatorName, make_simulator
from ses_core.simulation.robot import beam_directions

STANDING_MPS = 0.05
"""Slower than this, either way, is standing [m/s]."""

_BRIDGED_S = 1.0
"""Trouble that pauses for less than this is one trouble."""

_LEAST_STAND_S = 1.0
"""A shorter stand is no trouble: every robot turns on the spot now and then."""

_BEFORE_CONTACT_S = 0.4
"""How long before a collision one still sees what led to it."""

_ROUNDING_S = 1e-6  # times are whole multiples of a rounded period


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """Everything that decides an episode.

    Attributes:
        trial: Start, goal and seed.
        name: Of the policy, in tables.
        run_id: The run that the episode belongs to.
    """

    trial: Trial
    name: str
    policy: Policy
    simulation: SimulationSettings
    profile: RobotProfile
    simulator: SimulatorName = "batch"
    run_id: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeTrace:
    """A whole episode, one row per control tick; row 0 is the start.

    Attributes:
        drive: What decided it.
        episode: Its row of the table `episodes`.
        times: (K,) [s].
        poses: True poses (K, 3) [m, m, rad].
        velocities: Measured (K, 2) [m/s, rad/s].
        commands: Given by the planner in the tick that ended here (K, 2) [m/s, rad/s].
        parameters: Planner parameters (K, 8) in force from here on; they change once a second.
    """

    drive: Drive
    episode: Episode
    times: FloatArray
    poses: FloatArray
    velocities: FloatArray
    commands: FloatArray
    parameters: FloatArray

    @property
    def is_reversing(self) -> BoolArray:
        """Whether each tick (K,) was driven under a command with v < 0, as tables count."""
        return self.commands[:, 0] < 0.0

    @property
    def is_standing(self) -> BoolArray:
        """Whether the robot stood in each tick (K,), turning or not."""
        is_still = np.abs(self.velocities[:, 0]) < STANDING_MPS
        return is_still & ~self.is_reversing & (self.times > 0.0)

    @property
    def reversing_s(self) -> float:
        """Time driven under a command with v < 0 [s]."""
        return self._duration(self.is_reversing)

    @property
    def standing_s(self) -> float:
        """Time stood [s]."""
        return self._duration(self.is_standing)

    def _duration(self, chosen: BoolArray) -> float:
        period = float(self.times[1] - self.times[0])
        return round(int(chosen.sum()) * period, 6)


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeMoment:
    """What a robot had seen and planned when it last sensed.

    Attributes:
        time: Since the start [s].
        pose: Where the robot is in the world.
        believed: Where it takes itself to be, in the frame of costmap and plan.
        scan: Ends of the beams that returned (R, 2) [m], in the robot's frame.
        costs: (H, W), from 0 (free) to 254 (occupied).
        origin: Lower left corner of the costmap [m].
        resolution: Edge of a cell of the costmap [m].
        plan: Global plan ahead (P, 2) [m].
    """

    time: float
    pose: Pose2D
    believed: Pose2D
    scan: FloatArray
    costs: Float32Array
    origin: tuple[float, float]
    resolution: float
    plan: FloatArray


def record_episode(drive: Drive) -> EpisodeTrace:
    """Drive an episode as `evaluate` does, and record every tick."""
    with closing(_simulator(drive)) as simulator:
        ticks = [(simulator.state(), in_force) for in_force in _ticks(drive, simulator)]
    states, parameters = zip(*ticks, strict=True)
    return EpisodeTrace(
        drive=drive,
        episode=finished_episode(
            drive.trial,
            states[-1],
            0,
            policy=drive.name,
            simulator=drive.simulator,
            run_id=drive.run_id,
        ),
        times=np.array([state.times[0] for state in states]),
        poses=np.array([state.poses[0] for state in states]),
        velocities=np.array([state.velocities[0] for state in states]),
        commands=np.array([state.commands[0] for state in states]),
        parameters=np.array(parameters),
    )


def look_at(trace: EpisodeTrace, time: float) -> EpisodeMoment:
    """Drive an episode again up to a time [s], and give what the robot had sensed and planned.

    Robots sense a few times a second: the moment given is the last of these before the time, but
    not before the first plan.

    Raises:
        ValueError: The time is not within the episode.
    """
    simulation, last = trace.drive.simulation, len(trace.times) - 1
    if not 0.0 <= time <= trace.times[last] + _ROUNDING_S:
        raise ValueError(f"found {time:g} s, expected 0 to {trace.times[last]:g} s: it ended then")
    asked = int(np.searchsorted(trace.times, time + _ROUNDING_S, side="right")) - 1
    every = max(1, round(simulation.control_rate_hz / simulation.sensing_rate_hz))
    wanted = min(max(asked - asked % every, every), last)
    with closing(_simulator(trace.drive)) as simulator:
        next(islice(_ticks(trace.drive, simulator), wanted, None))
        return _moment(trace.drive, simulator)


def telling_time(trace: EpisodeTrace) -> float:
    """Choose the moment [s] that says most about an episode.

    Just before a collision; else amid the longest reversing, else the longest stand; else halfway.
    """
    times = trace.times
    if trace.episode.outcome == EpisodeOutcome.COLLISION.name.lower():
        return max(0.0, float(times[-1]) - _BEFORE_CONTACT_S)
    period = float(times[1] - times[0])
    least_stand = round(_LEAST_STAND_S / period)
    for is_trouble, least in ((trace.is_reversing, 1), (trace.is_standing, least_stand)):
        spans = stretches(is_trouble, bridged=round(_BRIDGED_S / period))
        troubles = [first + np.flatnonzero(is_trouble[first:end]) for first, end in spans]
        longest = max(troubles, key=len, default=np.zeros(0, dtype=np.int64))
        if len(longest) >= least:
            return float(times[longest[len(longest) // 2]])
    return float(times[-1]) / 2.0


def stretches(chosen: BoolArray, *, bridged: int = 0) -> list[tuple[int, int]]:
    """Give where rows (K,) are chosen without a break: first row, and row after the last.

    A break of at most `bridged` rows is none.
    """
    rows = np.flatnonzero(chosen)
    if not len(rows):
        return []
    breaks = np.flatnonzero(np.diff(rows) > bridged + 1)
    firsts, lasts = rows[np.r_[0, breaks + 1]], rows[np.r_[breaks, len(rows) - 1]]
    return [(int(first), int(last) + 1) for first, last in zip(firsts, lasts, strict=True)]


def _simulator(drive: Drive) -> Simulator:
    return make_simulator(
        drive.simulator, slots=1, profile=drive.profile, settings=drive.simulation
    )


def _ticks(drive: Drive, simulator: Simulator) -> Iterator[FloatArray]:
    """Drive tick by tick, stopping at the start and after each one.

    Yields:
        The planner parameters (8,) in force from here on.
    """
    observer = observer_for(drive.policy, drive.profile)
    per_decision = policy_ticks(drive.policy, simulator.time_step)
    simulator.reset(np.arange(1), [drive.trial.place.task], np.array([drive.trial.seed]))
    parameters = initial_parameters(1, drive.profile)
    while True:
        observations = observer.observe(simulator.scans(), simulator.state(), parameters)
        parameters = drive.policy.act(observations)
        for _ in range(per_decision):
            yield parameters[0]
            simulator.advance(parameters, 1)
            if simulator.state().outcomes[0] != EpisodeOutcome.RUNNING:
                yield parameters[0]
                return


def _moment(drive: Drive, simulator: Simulator) -> EpisodeMoment:
    state, costmap = simulator.state(), simulator.costmap(0)
    pose = Pose2D(*state.poses[0].tolist())
    return EpisodeMoment(
        time=float(state.times[0]),
        pose=pose,
        believed=Pose2D(*state.odometry[0].tolist()),
        scan=_scan_points(simulator.scans()[0], drive.profile),
        costs=costmap.costs,
        origin=costmap.origin,
        resolution=costmap.resolution,
        plan=simulator.plan(0),
    )


def _scan_points(ranges: Float32Array, profile: RobotProfile) -> FloatArray:
    """Give where beams (B,) [m] ended, (R, 2) [m] in the robot's frame."""
    laser = profile.laser
    has_return = (ranges >= laser.range_min_m) & (ranges <= laser.range_max_m)
    ends = ranges[has_return, None] * beam_directions(profile)[has_return]
    return from_frame(ends, Pose2D(laser.mount_x_m, laser.mount_y_m, laser.mount_yaw_rad))
