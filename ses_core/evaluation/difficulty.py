"""Verified difficulty: how hard places turn out when a policy drives through them again.

A scenario's label counts steps of one drive in the log, and travels badly into the place that is
rebuilt of it: the approach, the size of the cells and chance all have a part in it
(`docs/difficulty.md`). Recorded places are therefore entered heading as the log did.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.evaluation.episodes import Episode
from ses_core.evaluation.statistics import TIME_CAP_S, restricted_time
from ses_core.evaluation.trials import EvaluationTask, evaluate, evaluation_task
from ses_core.extraction.difficulty import CountKind
from ses_core.geometry import Pose2D, wrap_angles
from ses_core.navigation import NavigationEnvironment, environment_task
from ses_core.protocols import Policy
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class VerifiedDifficulty:
    """How hard one environment was; the fields are columns of the table `difficulties`.

    Attributes:
        policy_id: Who drove.
        trials: Drives, each with noise of its own; all else is their mean.
        negative_velocity_count: Ticks with v < 0.
        not_forward_count: Ticks with v <= 0.05 m/s.
        restricted_mean_time_s: A failure counts as 100 s.
    """

    environment_id: str
    policy_id: str
    trials: int
    negative_velocity_count: float
    not_forward_count: float
    success_rate: float
    restricted_mean_time_s: float

    @property
    def is_easy(self) -> bool:
        """Tell whether every trial got across without ever backing up."""
        return self.success_rate == 1.0 and self.negative_velocity_count == 0.0


def verify(
    environments: Sequence[NavigationEnvironment],
    policy: Policy,
    *,
    policy_id: str,
    headings: Mapping[str, float],
    trials: int,
    seed: int,
    simulation: SimulationSettings,
    profile: RobotProfile,
    progress: Callable[[float], None] = lambda _: None,
) -> list[VerifiedDifficulty]:
    """Let a policy cross each environment several times.

    What is found of an environment depends on none beside it.

    Args:
        environments: No two of one id.
        policy: Who drives.
        policy_id: Its name in the rows.
        headings: How a drive starts in an environment, by its id [rad in the frame of the
            scenario]; where nothing is said, heading for the goal.
        trials: Drives through each, under different noise.
        seed: Of all noise.
        simulation: Rates and imperfections of the robot.
        profile: The robot.
        progress: Hears the share that is done, from 0 to 1.

    Returns:
        In the order of the environments.
    """
    episodes = evaluate(
        {policy_id: policy},
        [_place(one, headings.get(one.environment_id, 0.0), profile) for one in environments],
        trials=trials,
        seed=seed,
        simulation=simulation,
        profile=profile,
        progress=progress,
    )
    return difficulties(episodes)


def _place(
    environment: NavigationEnvironment, heading: float, profile: RobotProfile
) -> EvaluationTask:
    task = environment_task(environment)
    start = Pose2D(task.start.x, task.start.y, heading)
    return evaluation_task(replace(task, start=start), pair=0, profile=profile)


def approach_heading(start: Pose2D, goal: tuple[float, float]) -> float:
    """Give the heading [rad] of a start against the way straight to the goal, in (-pi, pi]."""
    straight = math.atan2(goal[1] - start.y, goal[0] - start.x)
    return float(wrap_angles(np.array(start.yaw - straight)))


def difficulties(episodes: Sequence[Episode]) -> list[VerifiedDifficulty]:
    """Average the episodes of each world and policy, in the order in which they first appear."""
    driven: dict[tuple[str, str], list[Episode]] = {}
    for episode in episodes:
        driven.setdefault((episode.world_id, episode.policy), []).append(episode)
    return [
        VerifiedDifficulty(
            environment_id=world_id,
            policy_id=policy,
            trials=len(own),
            negative_velocity_count=float(np.mean([one.negative_velocity_count for one in own])),
            not_forward_count=float(np.mean([one.not_forward_count for one in own])),
            success_rate=float(np.mean([one.outcome == "success" for one in own])),
            restricted_mean_time_s=float(np.mean([restricted_time(one) for one in own])),
        )
        for (world_id, policy), own in driven.items()
    ]


def simulated_count(found: VerifiedDifficulty, kind: CountKind, *, period: float) -> float:
    """Give the simulated counterpart of a scenario's count; a tick lasts a period [s]."""
    match kind:
        case "negative":
            return found.negative_velocity_count
        case "not-forward":
            return found.not_forward_count
        case "reversing-seconds":
            return found.negative_velocity_count * period


def draw_weight(found: VerifiedDifficulty) -> float:
    """Give how often to train in an environment, from 0.2 (crossed at once) to 1.2 (never).

    In proportion to the restricted time, which grows with reversing and with failing alike;
    counts say little where a drive ends early. The rest keeps easy places in the training, lest
    a policy forget how to drive through them.
    """
    return 0.2 + found.restricted_mean_time_s / TIME_CAP_S


def draw_weights(
    environments: Sequence[NavigationEnvironment],
    found: Sequence[VerifiedDifficulty],
    use: Literal["ignore", "weigh", "filter"],
) -> FloatArray | None:
    """Give how often a training draws each environment (N,); None for equally often.

    Where every environment is easy, none is filtered out.

    Raises:
        ValueError: The difficulty of an environment is not known.
    """
    if use == "ignore":
        return None
    by_id = {one.environment_id: one for one in found}
    unknown = [one.environment_id for one in environments if one.environment_id not in by_id]
    if unknown:
        raise ValueError(
            f"found no difficulty of {len(unknown)} of {len(environments)} environments, "
            f"expected one of each, e.g. of {unknown[0]}"
        )
    ordered = [by_id[one.environment_id] for one in environments]
    if use == "weigh":
        return np.array([draw_weight(one) for one in ordered])
    is_kept = np.array([not one.is_easy for one in ordered])
    return is_kept.astype(np.float64) if is_kept.any() else None
