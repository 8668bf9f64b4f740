"""Training the parameter policy, from its parent or from nothing (leaf: torch)."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from ses_core.arrays import Float32Array, FloatArray
from ses_core.learning.action import ACTIONS, DEFAULT_ACTION
from ses_core.learning.algorithms import extract_policy, make_learner
from ses_core.learning.critics import extract_critic, set_critic
from ses_core.learning.decision_process import DecisionProcess
from ses_core.learning.observation import observation_for
from ses_core.learning.policies import HIDDEN_SIZES, ParameterPolicy, random_policy
from ses_core.learning.training_curve import CurvePoint
from ses_core.learning.training_monitor import StopReason, TrainingMonitor
from ses_core.learning.vector_env import VectorNavigationEnv
from ses_core.navigation import NavigationTask
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings, TrainingSettings
from ses_core.simulation.factory import make_simulator

_LEAST_ROUNDS = 16
"""A training shorter than this many decisions of each robot gets fewer robots."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingResult:
    """What a training gave.

    Attributes:
        critic: Tensors of its critic, by name.
        curve: Learning curve, oldest stretch first.
        steps: Decisions made.
        seconds: Wall time [s].
        reason: Why it ended; `diverged` hands out the best policy on the way.
    """

    policy: ParameterPolicy
    critic: Mapping[str, Float32Array]
    curve: tuple[CurvePoint, ...]
    steps: int
    seconds: float
    reason: StopReason


def train(
    tasks: Sequence[NavigationTask],
    *,
    parent: ParameterPolicy | None,
    critic: Mapping[str, Float32Array] | None = None,
    settings: TrainingSettings,
    simulation: SimulationSettings,
    profile: RobotProfile,
    weights: FloatArray | None = None,
    checkpoint: Mapping[str, bytes] | None = None,
    keep: Callable[[Mapping[str, bytes]], None] | None = None,
    progress: Callable[[float], None] = lambda _: None,
    deadline: Callable[[], bool] = lambda: False,
) -> TrainingResult:
    """Train a policy in tasks (section IV-A, APPLR).

    A parent's actor is gone on with, under its own observation and sizes, and every so often as
    it was trained to decide unless the settings say otherwise. Without its critic the first
    `critic_share` of the decisions trains a new one alone, so that what it does not know yet
    cannot spoil the actor.

    Equal arguments give equal weights on one machine, also for a training that was stopped and
    goes on from its checkpoint.

    Args:
        tasks: What episodes are drawn from.
        parent: The policy to go on from; None trains from random weights.
        critic: The parent's critic, to go on with.
        settings: Algorithm, decisions, seed.
        simulation: Rates and imperfections of the robot.
        profile: The robot.
        weights: How often each task is drawn; equally often without.
        checkpoint: Files of a checkpoint of this very training, to go on from.
        keep: Takes the files of every checkpoint; the last is enough.
        progress: Hears the share that is done, from 0 to 1.
        deadline: Asked after every decision; the training ends when it says yes.

    Raises:
        ArtifactError: The checkpoint is damaged, or of another learner.
        ValueError: There is no task, the critic is of another algorithm or size, or the parent
            sets other parameters than the settings ask for.
    """
    started = time.perf_counter()
    streams = np.random.SeedSequence(settings.seed).spawn(2)
    start = parent or random_policy(
        observation_for(settings.preset, profile),
        HIDDEN_SIZES[settings.preset],
        rng=np.random.default_rng(streams[0]),
        action=ACTIONS[settings.action or DEFAULT_ACTION],
    )
    if settings.action not in (None, start.action.name):
        raise ValueError(
            f"the policy to go on from sets {start.action.name} parameters, the settings ask for "
            f"{settings.action}"
        )
    start = replace(start, decision_period=settings.decision_period_s or start.decision_period)
    slots = min(settings.parallel_envs, max(1, settings.steps // _LEAST_ROUNDS))
    simulator = make_simulator(
        settings.simulator, slots=slots, profile=profile, settings=simulation
    )
    threads = torch.get_num_threads()
    # With more, torch and the simulator's threads take turns on the same cores: measured slower.
    torch.set_num_threads(1)
    try:
        process = DecisionProcess(
            simulator,
            tasks=tasks,
            observation=start.observation,
            action=start.action,
            profile=profile,
            settings=settings,
            decision_period=start.decision_period,
            weights=weights,
        )
        env = VectorNavigationEnv(process, rng=np.random.default_rng(streams[1]))
        learner, decisions = make_learner(
            env, start, settings=settings, is_fine_tuning=parent is not None
        )
        if critic is not None:
            set_critic(learner, critic)
        is_critic_new = parent is not None and critic is None
        monitor = TrainingMonitor(
            start=start,
            decisions=decisions,
            frozen_decisions=round(settings.critic_share * decisions) if is_critic_new else 0,
            checkpoint_decisions=settings.checkpoint_steps,
            keep=keep,
            progress=progress,
            deadline=deadline,
        )
        if checkpoint is not None:
            monitor.resume(checkpoint, learner)
        made = learner.num_timesteps
        learner.learn(decisions - made, callback=monitor, reset_num_timesteps=made == 0)
        final, final_critic = extract_policy(learner, start), extract_critic(learner)
    finally:
        torch.set_num_threads(threads)
        simulator.close()
    progress(1.0)
    return TrainingResult(
        policy=(monitor.best or start) if monitor.reason == "diverged" else final,
        critic=final_critic,
        curve=tuple(monitor.curve),
        steps=learner.num_timesteps,
        seconds=time.perf_counter() - started,
        reason=monitor.reason,
    )
