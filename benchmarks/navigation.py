"""What DWA slow and fast reach, and which modelling choice makes the difference.

On the paper's own houses (deployment and tuning parts, pairs at least 6.6 m apart), one choice
switched at a time, under every preset of imperfections, and in PyBullet; and on BARN's 300
courses by its protocol. The paper's pooled figures stand beside: slow 75.5 % and 43.8 s, fast 67
to 72 % and 31.7 s, about 23 % of scenarios above the threshold by its authors' count.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from _shared_worlds import barn_worlds, drawn_tasks, houses

from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.evaluation.statistics import rate_interval
from ses_core.extraction.segmentation import closing_steps
from ses_core.learning.policies import FixedParameters
from ses_core.navigation import NavigationTask
from ses_core.planning.parameters import DWA_FAST, DWA_SLOW, PlannerParameters
from ses_core.robot_profile import JACKAL, RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.factory import SimulatorName
from ses_core.worlds.deployment import deploy

SEED = 2026
THRESHOLD = 50
DISTANCE_M = 5.0
NOT_FORWARD_MPS = 0.05
REAL = SimulationSettings()


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """One row: what drives where."""

    name: str
    parameters: PlannerParameters = DWA_SLOW
    settings: SimulationSettings = REAL
    profile: RobotProfile = JACKAL
    simulator: SimulatorName = "batch"


class Drive(NamedTuple):
    """What one deployment came to."""

    world: str
    outcome: EpisodeOutcome
    time: float
    negative: list[int]  # steps with v < 0, per scenario
    not_forward: list[int]  # steps with v <= 0.05 m/s, per scenario


def measure(
    scratch: Path, *, pairs: int = 2, bullet_pairs: int = 1, barn: int = 300
) -> list[dict[str, str | float]]:
    """Give a row per setup."""
    worlds = houses("deployment", "tuning")
    tasks = drawn_tasks(worlds, pairs, seed=SEED)
    rows = [_row(f"houses, {setup.name}", _drives(setup, tasks)) for setup in _house_setups()]
    few = drawn_tasks(worlds, bullet_pairs, seed=SEED)
    for setup in _bullet_setups():
        rows.append(_row(f"houses, {setup.name}", _drives(setup, few)))
    courses = drawn_tasks(barn_worlds(scratch, range(barn)), 1, seed=SEED)
    unscaled = _with_planner("occdist_scale", 0.005)
    for setup in (
        *_both("BARN", REAL),
        Setup(name="BARN, occdist_scale 0.005, slow", profile=unscaled),
        Setup(name="BARN, occdist_scale 0.005, fast", profile=unscaled, parameters=DWA_FAST),
    ):
        rows.append(_row(setup.name, _drives(setup, courses)))
    return rows


def _both(
    name: str, settings: SimulationSettings, simulator: SimulatorName = "batch"
) -> list[Setup]:
    make = partial(Setup, settings=settings, simulator=simulator)
    return [
        make(name=f"{name}, slow", parameters=DWA_SLOW),
        make(name=f"{name}, fast", parameters=DWA_FAST),
    ]


def _with_planner(key: str, value: float) -> RobotProfile:
    planner = JACKAL.planner.model_copy(update={key: value})
    return JACKAL.model_copy(update={"planner": planner})


def _house_setups() -> Iterator[Setup]:
    for preset in ("real", "clean", "half", "double"):
        yield from _both(preset, SimulationSettings(imperfections=preset))
    yield from _both("real, sensing at 20 Hz", SimulationSettings(sensing_rate_hz=20.0))
    yield Setup(name="real, known map, slow", settings=SimulationSettings(known_map=True))
    for padding in (0.05, 0.0):
        yield Setup(
            name=f"real, padding {padding} m, slow",
            profile=JACKAL.model_copy(update={"footprint_padding_m": padding}),
        )
    for key, value in (("occdist_scale", 0.005), ("min_vel_x", 0.0)):
        yield Setup(name=f"real, {key} {value}, slow", profile=_with_planner(key, value))
    for radius in (0.1, 0.5):
        yield Setup(
            name=f"real, inflation {radius} m, slow",
            parameters=PlannerParameters(inflation_radius=radius),
        )


def _bullet_setups() -> Iterator[Setup]:
    for preset in ("real", "clean", "half", "double"):
        settings = SimulationSettings(imperfections=preset)
        yield from _both(f"PyBullet, {preset}", settings, "bullet")


def _drives(setup: Setup, tasks: Sequence[NavigationTask]) -> list[Drive]:
    return [
        Drive(
            deployment.task.world.world_id,
            deployment.outcome,
            float(deployment.times[-1]),
            *_counts(deployment.poses[:, :2], deployment.commands[:, 0]),
        )
        for deployment in deploy(
            tasks,
            FixedParameters(setup.parameters),
            seed=SEED,
            simulation=setup.settings,
            profile=setup.profile,
            simulator=setup.simulator,
            slots=32 if setup.simulator == "batch" else 8,
        )
    ]


def _counts(
    positions: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
    speeds: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
) -> tuple[list[int], list[int]]:
    """Count both kinds of steps in every closed scenario, from (K, 2) [m] and (K - 1,) [m/s]."""
    ends = closing_steps(positions, DISTANCE_M).tolist()
    spans = list(zip([0, *ends[:-1]], ends, strict=True)) if ends else []
    return (
        [int(np.sum(speeds[first:last] < 0.0)) for first, last in spans],
        [int(np.sum(speeds[first:last] <= NOT_FORWARD_MPS)) for first, last in spans],
    )


def measured_row(setup: Setup, tasks: Sequence[NavigationTask]) -> dict[str, str | float]:
    """Drive a setup through tasks and give its row."""
    return _row(setup.name, _drives(setup, tasks))


def _row(name: str, drives: Sequence[Drive]) -> dict[str, str | float]:
    outcomes = np.array([drive.outcome for drive in drives])
    reached = outcomes == EpisodeOutcome.SUCCESS
    interval = rate_interval(
        reached.astype(np.float64), [drive.world for drive in drives], seed=SEED
    )
    low, high = interval or (float("nan"), float("nan"))
    times = np.array([drive.time for drive in drives])
    negative = np.concatenate([drive.negative for drive in drives])
    not_forward = np.concatenate([drive.not_forward for drive in drives])
    return {
        "name": name,
        "n": len(drives),
        "success_%": _percent(reached),
        "from_%": round(100.0 * low, 1),
        "to_%": round(100.0 * high, 1),
        "time_s": round(float(times[reached].mean()), 1) if reached.any() else float("nan"),
        "collision_%": _percent(outcomes == EpisodeOutcome.COLLISION),
        "stuck_%": _percent(outcomes == EpisodeOutcome.STUCK),
        "timeout_%": _percent(outcomes == EpisodeOutcome.TIMEOUT),
        "scenarios": len(negative),
        "negative>50_%": _percent(negative > THRESHOLD),
        "not_forward>50_%": _percent(not_forward > THRESHOLD),
    }


def _percent(flags: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> float:
    return round(100.0 * float(np.mean(flags)), 1) if len(flags) else float("nan")
