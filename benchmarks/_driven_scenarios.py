"""Scenarios of simulated deployments in houses, whose true surroundings are known."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.extraction.extract import extract
from ses_core.extraction.recording import ScanStream
from ses_core.extraction.scenario import Scenario
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationEnvironment, NavigationTask, World
from ses_core.protocols import Policy
from ses_core.robot_profile import RobotProfile
from ses_core.settings import ExtractionSettings, FilterSettings, SimulationSettings
from ses_core.worlds.deployment import Deployment, deploy


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivenScenario:
    """A scenario as the log has it, and where it truly was.

    Attributes:
        start: True pose of its first step in its house [m, m, rad].
        goal: True position of its last step in its house [m].
    """

    house: World
    scenario: Scenario
    environment: NavigationEnvironment
    start: Pose2D
    goal: tuple[float, float]


def driven_scenarios(
    tasks: Sequence[NavigationTask],
    policy: Policy,
    *,
    seed: int,
    simulation: SimulationSettings,
    profile: RobotProfile,
) -> list[DrivenScenario]:
    """Deploy a policy, and cut its logs into scenarios whose place was rebuilt well enough."""
    driven = deploy(tasks, policy, seed=seed, simulation=simulation, profile=profile)
    in_order = sorted(driven, key=lambda one: one.number)
    return [found for one in in_order for found in _scenarios(one, profile)]


def _scenarios(deployment: Deployment, profile: RobotProfile) -> Iterator[DrivenScenario]:
    rules = FilterSettings()
    for found in extract(
        [_trajectory(deployment, profile)],
        log_id=f"{deployment.task.world.world_id}-{deployment.number}",
        recorded_map=None,
        settings=ExtractionSettings(),
        profile=profile,
        target=profile,
    ):
        scenario, place, quality = found.scenario, found.environment, found.quality
        if scenario.kind != "scenario" or place is None or quality is None:
            continue
        if not quality.is_traversable:
            continue
        if quality.path_in_free_fraction < rules.min_path_in_free_fraction:
            continue
        if quality.observed_fraction < rules.min_observed_fraction:
            continue
        first, last = deployment.poses[scenario.first_step], deployment.poses[scenario.last_step]
        yield DrivenScenario(
            house=deployment.task.world,
            scenario=scenario,
            environment=place,
            start=Pose2D(*first.tolist()),
            goal=(float(last[0]), float(last[1])),
        )


def _trajectory(deployment: Deployment, profile: RobotProfile) -> Trajectory:
    """Put a deployment, which is on the clock already, into the form that logs are read into."""
    laser, steps = profile.laser, deployment.scan_steps
    stamps = np.rint(deployment.times * 1e9).astype(np.int64)
    # No command follows the last step.
    commanded: FloatArray = np.concatenate((deployment.commands, deployment.commands[-1:]))
    return Trajectory(
        first_step=0,
        stamps_ns=stamps,
        poses=deployment.odometry,
        commanded=commanded,
        measured=deployment.measured,
        speed=commanded[:, 0],
        has_clock=True,
        scans=ScanStream(
            stamps_ns=stamps[steps],
            ranges=deployment.ranges,
            angles=np.linspace(laser.angle_min_rad, laser.angle_max_rad, laser.beams),
            range_max=laser.range_max_m,
            mount=Pose2D(laser.mount_x_m, laser.mount_y_m, laser.mount_yaw_rad),
        ),
        scan_poses=deployment.odometry[steps],
    )
