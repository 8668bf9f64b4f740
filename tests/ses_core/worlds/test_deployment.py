from dataclasses import replace

import numpy as np
import pytest

from ses_core.arrays import FloatArray
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.geometry import Pose2D
from ses_core.learning.observation import DEFAULT_OBSERVATION
from ses_core.learning.policies import FIXED_POLICIES, ParameterPolicy, random_policy
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings
from ses_core.worlds.deployment import Deployment, deploy
from tests.simulated import flawed

SLOW = FIXED_POLICIES["dwa-slow"]


def _task(length: float) -> NavigationTask:
    """Drive `length` metres straight along a room 4 m wide."""
    cells = np.zeros((40, 120), dtype=np.bool_)
    grid = OccupancyGrid(cells=cells, resolution=0.1, origin=(-2.0, -2.0))
    return NavigationTask(
        world=World(world_id="room", grid=grid), start=Pose2D(0.0, 0.0, 0.2), goal=(length, 0.5)
    )


TASKS = [_task(3.0), _task(6.0), _task(4.0)]


def _deploy(slots: int, *, seed: int = 0) -> dict[int, Deployment]:
    deployments = deploy(
        TASKS,
        SLOW,
        seed=seed,
        simulation=SimulationSettings(),
        profile=JACKAL,
        slots=slots,
    )
    return {deployment.number: deployment for deployment in deployments}


def test_every_task_is_driven_once_to_its_goal() -> None:
    driven = _deploy(2)
    assert sorted(driven) == [0, 1, 2]
    for number, deployment in driven.items():
        assert deployment.task is TASKS[number]
        assert deployment.outcome is EpisodeOutcome.SUCCESS
        shift, turn = np.hypot(*deployment.poses[0, :2]), abs(deployment.poses[0, 2] - 0.2)
        assert 0.0 < shift <= 0.25
        assert 0.0 < turn <= 0.157
        assert deployment.odometry[0].tolist() == [0.0, 0.0, 0.0]
        to_goal = np.hypot(*(deployment.poses[:, :2] - TASKS[number].goal).T)
        assert to_goal[-1] <= 1.0 < to_goal[-2]


def test_records_fit_together_step_by_step() -> None:
    deployment = _deploy(3)[1]
    steps = len(deployment.times)
    assert np.allclose(np.diff(deployment.times), 0.05)
    assert deployment.commands.shape == (steps - 1, 2)
    # A scan arrives every fourth step, one step late.
    assert deployment.scan_steps.tolist() == [0, *range(3, steps - 1, 4)]
    assert deployment.ranges.shape == (len(deployment.scan_steps), 720)
    # The measured speed is that of the motion that led to a step.
    driven = np.hypot(*np.diff(deployment.poses[:, :2], axis=0).T) / 0.05
    assert np.allclose(driven, np.abs(deployment.measured[1:, 0]), atol=0.02)
    assert deployment.commands[:, 0].max() == pytest.approx(0.5, abs=1e-6)


def test_a_command_reaches_the_wheels_after_its_delay() -> None:
    (deployment,) = deploy(
        [_task(3.0)],
        SLOW,
        seed=0,
        simulation=flawed(command_delay_ticks=1),
        profile=JACKAL,
    )
    # Command k, given at step k, drives the robot from step k + 1 to step k + 2.
    assert np.allclose(deployment.measured[2:], deployment.commands[:-1], atol=1e-6)
    assert np.ptp(deployment.commands[:, 1]) > 0.1


def test_scans_belong_to_the_poses_they_are_stored_with() -> None:
    deployment = _deploy(3)[1]
    middle = 360  # the beam straight ahead, to within half a beam
    for k, step in enumerate(deployment.scan_steps):
        x, y, yaw = deployment.poses[step]
        # The room reaches from (-2, -2) to (10, 2).
        ahead = min(
            ((10.0 if np.cos(yaw) > 0 else -2.0) - x) / np.cos(yaw),
            ((2.0 if np.sin(yaw) > 0 else -2.0) - y) / np.sin(yaw) if np.sin(yaw) else np.inf,
        )
        assert deployment.ranges[k, middle] == pytest.approx(ahead, rel=0.05, abs=0.06)


def test_a_deployment_depends_on_its_number_and_seed_alone() -> None:
    alone, among = _deploy(1), _deploy(3)
    for number in alone:
        assert alone[number].poses.tobytes() == among[number].poses.tobytes()
        assert alone[number].odometry.tobytes() == among[number].odometry.tobytes()
        assert alone[number].ranges.tobytes() == among[number].ranges.tobytes()
    assert _deploy(3, seed=1)[0].poses.tobytes() != alone[0].poses.tobytes()


def test_a_policy_decides_as_often_as_it_was_trained_to(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = random_policy(DEFAULT_OBSERVATION, (8,), rng=np.random.default_rng(0))
    counts: dict[float, int] = {0.25: 0, 1.0: 0}
    act = ParameterPolicy.act

    def counted(policy: ParameterPolicy, observations: FloatArray) -> FloatArray:
        counts[policy.decision_period] += 1
        return act(policy, observations)

    monkeypatch.setattr(ParameterPolicy, "act", counted)
    for period in counts:
        policy = replace(drawn, decision_period=period)
        (deployment,) = deploy(
            TASKS[:1], policy, seed=0, simulation=SimulationSettings(), profile=JACKAL
        )
        assert counts[period] == np.ceil(deployment.times[-1] / period - 1e-9)


def test_no_task_no_deployment() -> None:
    settings = SimulationSettings()
    assert list(deploy([], SLOW, seed=0, simulation=settings, profile=JACKAL)) == []
