"""A small fleet's inbox: real bags of robots that drove through generated homes."""

from datetime import date
from pathlib import Path

import numpy as np

from ses_core.learning.policies import FIXED_POLICIES
from ses_core.robot_profile import JACKAL
from ses_core.settings import Settings, SimulationSettings
from ses_core.worlds.deployment import deploy
from ses_core.worlds.homes import generate_homes
from ses_core.worlds.pairs import sample_tasks
from storage.deployment_logs import write_deployments

DAY = date(2026, 3, 1)


def write_fleet(inbox: Path, *, homes: int = 2, drives: int = 4, seed: int = 7) -> int:
    """Let two robots per home drive, and write one MCAP log per drive; gives how many."""
    tasks = [
        task
        for number, world in enumerate(generate_homes(homes, seed=seed))
        for task in sample_tasks(
            world, drives, profile=JACKAL, rng=np.random.default_rng([seed, number])
        )
    ]
    driven = deploy(
        tasks,
        FIXED_POLICIES["dwa-slow"],
        seed=seed,
        simulation=SimulationSettings(sensing_rate_hz=2.0),
        profile=JACKAL,
    )
    logs = write_deployments(
        inbox, driven, tasks=tasks, format="mcap", day=DAY, settings=Settings()
    )
    return len(logs)
