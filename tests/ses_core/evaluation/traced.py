"""Drives to record: a room that is crossed, one that nobody gets out of, and made-up traces."""

from dataclasses import replace

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.evaluation.episode_trace import Drive, EpisodeTrace
from ses_core.evaluation.trials import evaluation_task, trial_of
from ses_core.learning.policies import FIXED_POLICIES
from ses_core.navigation import NavigationTask
from ses_core.protocols import Policy
from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings
from ses_core.simulation.factory import SimulatorName
from tests.ses_core.evaluation.episode_lists import episode
from tests.ses_core.learning.places import corridor

SIMULATION = SimulationSettings(time_limit_s=40.0, stuck_time_s=10.0)


def drive(
    task: NavigationTask | None = None,
    *,
    policy: Policy = FIXED_POLICIES["dwa-slow"],
    simulation: SimulationSettings = SIMULATION,
    simulator: SimulatorName = "batch",
) -> Drive:
    """Trial 1 of pair 0 in the evaluation with seed 3."""
    place = evaluation_task(task or corridor(), pair=0, profile=JACKAL)
    return Drive(
        trial=trial_of(place, 1, seed=3),
        name="driver",
        policy=policy,
        simulation=simulation,
        profile=JACKAL,
        simulator=simulator,
    )


def made_up(speeds: FloatArray, *, outcome: str = "success") -> EpisodeTrace:
    """A drive at speeds (K,) [m/s] along the corridor, one row each 0.05 s after the start."""
    commands = np.zeros((len(speeds) + 1, 2))
    commands[1:, 0] = speeds
    poses = np.zeros((len(commands), 3))
    poses[:, 0] = 1.5 + 0.05 * np.cumsum(commands[:, 0])
    poses[:, 1] = 1.5
    return EpisodeTrace(
        drive=drive(),
        episode=replace(
            episode("driver", "corridor", outcome, 0.05 * len(speeds)),
            negative_velocity_count=int((speeds < 0.0).sum()),
            not_forward_count=int((speeds <= 0.05).sum()),
        ),
        times=0.05 * np.arange(len(commands), dtype=np.float64),
        poses=poses,
        velocities=commands.copy(),
        commands=commands,
        parameters=np.tile(FIXED_POLICIES["dwa-slow"].parameters.as_array(), (len(commands), 1)),
    )
