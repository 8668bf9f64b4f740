"""Paired trials: several policies on the same worlds, pairs and seeds."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ses_core.evaluation.episodes import BARN_SPEED_MPS, Episode, barn_score
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.learning.policies import observer_for, policy_ticks
from ses_core.navigation import NavigationTask
from ses_core.planning.global_planner import optimal_path_length
from ses_core.planning.parameters import initial_parameters
from ses_core.protocols import Policy, Simulator, SimulatorState
from ses_core.recipes import digest_json
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.factory import SimulatorName, make_simulator


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluationTask:
    """One start-goal pair of a held-out world.

    Attributes:
        pair: Number of the pair within its world.
        optimal_time_s: Shortest drivable path at 2 m/s [s].
    """

    world_id: str
    pair: int
    task: NavigationTask
    optimal_time_s: float


@dataclass(frozen=True, slots=True)
class Trial:
    """A trial to be driven; it is the same for every policy.

    Attributes:
        number: Its number among the trials of its pair.
        seed: Of the robot's and the sensor's noise in this trial.
    """

    place: EvaluationTask
    number: int
    seed: int


def evaluation_task(task: NavigationTask, *, pair: int, profile: RobotProfile) -> EvaluationTask:
    """Measure a task's shortest path on the true map and make it a pair of its world.

    Where no path is wide enough for the robot, the straight line stands in: the trial counts
    as any other, and will fail.
    """
    start = (task.start.x, task.start.y)
    length = optimal_path_length(
        task.world.grid, start, task.goal, radius=profile.inscribed_radius_m
    )
    if not np.isfinite(length):
        length = float(np.hypot(task.goal[0] - start[0], task.goal[1] - start[1]))
    return EvaluationTask(
        world_id=task.world.world_id,
        pair=pair,
        task=task,
        optimal_time_s=length / BARN_SPEED_MPS,
    )


def trial_of(place: EvaluationTask, number: int, *, seed: int) -> Trial:
    """Give a pair's trial in the evaluation with a seed: 31 bits of the digest of what names it."""
    named = digest_json([seed, place.world_id, place.pair, number])
    return Trial(place, number, int(named[:8], 16) >> 1)


def evaluate(
    policies: Mapping[str, Policy],
    places: Sequence[EvaluationTask],
    *,
    trials: int,
    seed: int,
    simulation: SimulationSettings,
    profile: RobotProfile,
    simulator: SimulatorName = "batch",
    slots: int = 64,
    run_id: str = "",
    progress: Callable[[float], None] = lambda _: None,
) -> list[Episode]:
    """Drive every policy through the same trials.

    The seed of a trial depends on the evaluation's seed, world, pair and trial alone: neither
    the policies nor the places beside it, nor the number of slots, change an episode.

    Args:
        policies: By the name they have in tables, in the order they are to be compared.
        places: Start-goal pairs, no two alike in world and pair.
        trials: Trials of each pair and policy.
        seed: Seed of the whole evaluation.
        simulation: Rates and imperfections of the robot.
        profile: The robot.
        simulator: Name of the simulator (`batch` or `bullet`).
        slots: Episodes driven side by side.
        run_id: The run that the episodes belong to.
        progress: Hears the share that is done, from 0 to 1.

    Returns:
        Episodes by policy, place and trial, in the order given.

    Raises:
        ValueError: Two places have the same world and pair.
    """
    pairs = [(place.world_id, place.pair) for place in places]
    if len(set(pairs)) < len(pairs):
        raise ValueError(f"{len(pairs)} places have {len(set(pairs))} different worlds and pairs")
    schedule = [trial_of(place, number, seed=seed) for place in places for number in range(trials)]
    if not schedule:
        return []
    total = len(schedule) * len(policies)
    episodes: list[Episode] = []
    driver = make_simulator(
        simulator, slots=min(slots, len(schedule)), profile=profile, settings=simulation
    )
    try:
        for name, policy in policies.items():
            before = len(episodes)
            episodes += _drive(
                name,
                policy,
                schedule,
                driver,
                profile=profile,
                simulator_name=simulator,
                run_id=run_id,
                finished=partial(_report, progress, before, total),
            )
    finally:
        driver.close()
    return episodes


def _report(progress: Callable[[float], None], before: int, total: int, count: int) -> None:
    progress((before + count) / total)


def _drive(
    name: str,
    policy: Policy,
    schedule: Sequence[Trial],
    simulator: Simulator,
    *,
    profile: RobotProfile,
    simulator_name: SimulatorName,
    run_id: str,
    finished: Callable[[int], None],
) -> list[Episode]:
    """Drive one policy through the schedule, refilling slots as episodes end."""
    observer = observer_for(policy, profile)
    ticks = policy_ticks(policy, simulator.time_step)
    waiting = deque(range(len(schedule)))
    driven = np.full(simulator.slots, -1)
    parameters = initial_parameters(simulator.slots, profile)
    episodes: dict[int, Episode] = {}
    idle = np.arange(simulator.slots)
    while len(episodes) < len(schedule):
        slots = idle[: len(waiting)]
        driven[idle] = -1
        driven[slots] = [waiting.popleft() for _ in slots]
        if len(slots):
            trials = [schedule[number] for number in driven[slots]]
            seeds = np.array([trial.seed for trial in trials], dtype=np.int64)
            simulator.reset(slots, [trial.place.task for trial in trials], seeds)
            parameters[slots] = initial_parameters(len(slots), profile)
        observations = observer.observe(simulator.scans(), simulator.state(), parameters)
        parameters = policy.act(observations)
        simulator.advance(parameters, ticks)
        state = simulator.state()
        idle = np.flatnonzero((state.outcomes != EpisodeOutcome.RUNNING) & (driven >= 0))
        for slot in idle:
            episodes[int(driven[slot])] = finished_episode(
                schedule[driven[slot]],
                state,
                int(slot),
                policy=name,
                simulator=simulator_name,
                run_id=run_id,
            )
        finished(len(episodes))
    return [episodes[number] for number in range(len(schedule))]


def finished_episode(
    trial: Trial,
    state: SimulatorState,
    slot: int,
    *,
    policy: str,
    simulator: SimulatorName,
    run_id: str = "",
) -> Episode:
    """Give the row of the trial that ended in a slot.

    Args:
        trial: What was driven.
        state: Of the simulator, once the episode has ended.
        slot: Where it was driven.
        policy: Name of who drove.
        simulator: Name of where.
        run_id: The run that the episode belongs to.
    """
    place = trial.place
    outcome, time = EpisodeOutcome(int(state.outcomes[slot])), float(state.times[slot])
    return Episode(
        episode_id=digest_json(
            [run_id, policy, place.world_id, place.pair, trial.number, trial.seed]
        )[:16],
        run_id=run_id,
        policy=policy,
        world_id=place.world_id,
        pair=place.pair,
        trial=trial.number,
        seed=trial.seed,
        outcome=outcome.name.lower(),
        time_s=time,
        path_length_m=float(state.path_lengths[slot]),
        optimal_time_s=place.optimal_time_s,
        barn_score=barn_score(outcome, time=time, optimal_time=place.optimal_time_s),
        negative_velocity_count=int(state.negative_counts[slot]),
        not_forward_count=int(state.not_forward_counts[slot]),
        simulator=simulator,
        start_x_m=place.task.start.x,
        start_y_m=place.task.start.y,
        start_yaw_rad=place.task.start.yaw,
        goal_x_m=place.task.goal[0],
        goal_y_m=place.task.goal[1],
    )
