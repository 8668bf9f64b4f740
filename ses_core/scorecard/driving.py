"""How hard environments are for a policy: it drives through each, real and synthesized alike."""

from collections.abc import Callable

import numpy as np

from ses_core.arrays import BoolArray, FloatArray
from ses_core.evaluation.places import crossing_places
from ses_core.evaluation.statistics import restricted_time
from ses_core.evaluation.trials import evaluate
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from ses_core.protocols import Policy
from ses_core.recipes import digest_json
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings

DRIVEN_MEASURES = {"success": "share", "time": "s", "reversing steps": "count"}
"""Units of what a drive gives; a failure takes the cap of 100 s."""


def driven_measures(
    cells: BoolArray,
    name: str,
    policy: Policy,
    *,
    simulation: SimulationSettings,
    profile: RobotProfile,
    seed: int,
    progress: Callable[[float], None] = lambda _: None,
) -> dict[str, FloatArray]:
    """Drive once through each environment (N, 30, 30), no two equal, side by side.

    The noise depends on the cells and the seed alone, so the same place always gives the same
    drive.

    Returns:
        The `DRIVEN_MEASURES`, each (N,).
    """
    environments = tuple(
        NavigationEnvironment(
            environment_id=digest_json([np.packbits(one).tobytes().hex()])[:16],
            cells=one,
            observed=np.ones_like(one),
            origin="scorecard",
        )
        for one in cells
    )
    episodes = evaluate(
        {name: policy},
        crossing_places(NavigationDomain(environments), profile),
        trials=1,
        seed=seed,
        simulation=simulation,
        profile=profile,
        progress=progress,
    )
    return {
        "success": np.array([float(one.outcome == "success") for one in episodes]),
        "time": np.array([restricted_time(one) for one in episodes]),
        "reversing steps": np.array([float(one.negative_velocity_count) for one in episodes]),
    }
