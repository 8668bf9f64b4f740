"""`DecisionProcess`: what one decision does, shared by the Gymnasium env and its vector form."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from ses_core.arrays import Float32Array, FloatArray, IntArray
from ses_core.geometry import Pose2D, compose
from ses_core.learning.action import ActionSpec
from ses_core.learning.observation import ObservationSpec, make_observer
from ses_core.learning.policies import DECISION_PERIOD_S, decision_ticks
from ses_core.learning.reward import nearness, reward_of, rewards, way_made
from ses_core.navigation import NavigationTask
from ses_core.occupancy import occupied_at
from ses_core.planning.parameters import initial_parameters
from ses_core.protocols import Simulator
from ses_core.robot_profile import RobotProfile
from ses_core.settings import TrainingSettings
from ses_core.simulation.episode_start import padded_outline


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """What came of one decision of each of N robots.

    Attributes:
        rewards: (N,).
        outcomes: `EpisodeOutcome` values (N,); RUNNING while unfinished.
        times: Time since the start (N,) [s].
    """

    rewards: FloatArray
    outcomes: IntArray
    times: FloatArray


class DecisionProcess:
    """N robots that get new planner parameters every so often, by default every second.

    Episodes start in tasks drawn from a list, at a start pose that is turned and shifted a
    little, so that a policy cannot learn one approach by heart.
    """

    def __init__(
        self,
        simulator: Simulator,
        *,
        tasks: Sequence[NavigationTask],
        observation: ObservationSpec,
        action: ActionSpec,
        profile: RobotProfile,
        settings: TrainingSettings,
        decision_period: float = DECISION_PERIOD_S,
        weights: FloatArray | None = None,
    ) -> None:
        """Prepare the process; no slot runs before it is restarted.

        Args:
            simulator: N slots; closed by whoever made it.
            tasks: What episodes are drawn from.
            observation: What is seen.
            action: What is set.
            profile: The robot.
            settings: Reward and jitter.
            decision_period: Driving between two decisions [s].
            weights: How often each task is drawn, in any scale; equally often without.
        """
        if not tasks:
            raise ValueError("found no task to train in, expected at least one")
        self.simulator = simulator
        self.observation = observation
        self.action = action
        self._tasks = list(tasks)
        self._shares = None if weights is None else weights / weights.sum()
        self._observer = make_observer(observation, profile, action=action)
        self._profile = profile
        self._settings = settings
        self._reward = reward_of(settings)
        self._ticks = decision_ticks(decision_period, simulator.time_step)
        self._parameters = initial_parameters(simulator.slots, profile)
        self._starts = np.zeros((simulator.slots, 2))
        self._way = np.zeros(simulator.slots)

    def restart(self, slots: IntArray, *, rng: Generator) -> None:
        """Start an episode in a task of its own in each of the slots (S,)."""
        if len(slots) == 0:
            return
        drawn = rng.choice(len(self._tasks), size=len(slots), p=self._shares)
        tasks = [
            jittered(self._tasks[number], profile=self._profile, settings=self._settings, rng=rng)
            for number in drawn
        ]
        self.simulator.reset(slots, tasks, rng.integers(2**31, size=len(slots)))
        self._parameters[slots] = initial_parameters(len(slots), self._profile)
        state = self.simulator.state()
        self._starts[slots] = state.poses[slots, :2]
        self._way[slots] = way_made(self._reward, state, self._starts)[slots]

    def observe(self) -> Float32Array:
        """Give what every robot sees now: (N, D)."""
        observations = self._observer.observe(
            self.simulator.scans(), self.simulator.state(), self._parameters
        )
        return observations.astype(np.float32)

    def decide(self, actions: FloatArray) -> Decision:
        """Set parameters from actions (N, A) in [-1, 1] and drive until the next decision."""
        self._parameters = self.action.decode(np.asarray(actions, dtype=np.float64))
        self.simulator.advance(self._parameters, self._ticks)
        state = self.simulator.state()
        before, self._way = self._way, way_made(self._reward, state, self._starts)
        least_range = self._profile.laser.range_min_m
        return Decision(
            rewards=rewards(
                self._reward,
                before=before,
                after=self._way,
                outcomes=state.outcomes,
                near=nearness(self.simulator.scans(), least_range=least_range),
            ),
            outcomes=state.outcomes,
            times=state.times,
        )


def jittered(
    task: NavigationTask, *, profile: RobotProfile, settings: TrainingSettings, rng: Generator
) -> NavigationTask:
    """Turn and shift a task's start at random; left as it is where the body would not fit."""
    yaw = rng.uniform(-1.0, 1.0) * settings.start_yaw_jitter_rad
    sideways = rng.uniform(-1.0, 1.0) * settings.start_sideways_jitter_m
    start = compose(task.start, Pose2D(0.0, sideways, yaw))
    if occupied_at(task.world.grid, padded_outline(start, profile)).any():
        return task
    return replace(task, start=start)
