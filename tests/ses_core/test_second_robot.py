"""Robots that are no Jackal, round and with a laser all round, through everything.

They are simulated, seen through an observation of their own, trained, measured and bundled, and
what they can cross goes by their own radius.
"""

import numpy as np
import pytest

from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.evaluation.trials import evaluate, evaluation_task
from ses_core.learning.observation import observation_for
from ses_core.learning.policies import FIXED_POLICIES, ParameterPolicy
from ses_core.learning.policy_bundle import Lineage, pack_bundle, unpack_bundle
from ses_core.learning.reward import reward_of
from ses_core.learning.training import TrainingResult, train
from ses_core.navigation import NavigationEnvironment, environment_task
from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.planning.parameters import DWA_FAST
from ses_core.robot_profile import JACKAL, NEATO, TURTLEBOT4, RobotProfile
from ses_core.settings import SimulationSettings, TrainingSettings
from ses_core.simulation.factory import SimulatorName, make_simulator
from ses_core.synthesis.traversability import traversable
from tests.contracts.simulator import check_simulator
from tests.ses_core.learning.places import corridor

SIMULATION = SimulationSettings(sensing_rate_hz=2.0)
TRAINING = TrainingSettings(steps=320, parallel_envs=16)


def gap(width: int) -> NavigationEnvironment:
    """An environment crossed by a wall with a gap of so many cells of 0.167 m."""
    cells = np.zeros((ENVIRONMENT_CELLS, ENVIRONMENT_CELLS), dtype=np.bool_)
    cells[15, :] = True
    middle = ENVIRONMENT_CELLS // 2
    cells[15, middle - width // 2 : middle - width // 2 + width] = False
    return NavigationEnvironment(
        environment_id=f"gap-{width}", cells=cells, observed=np.ones_like(cells), origin="drawn"
    )


@pytest.fixture(scope="module", params=[TURTLEBOT4, NEATO], ids=lambda profile: profile.name)
def robot(request: pytest.FixtureRequest) -> RobotProfile:
    profile: RobotProfile = request.param
    return profile


@pytest.fixture(scope="module")
def trained(robot: RobotProfile) -> TrainingResult:
    return train([corridor()], parent=None, settings=TRAINING, simulation=SIMULATION, profile=robot)


@pytest.mark.parametrize("simulator", ["batch", "bullet"])
def test_it_keeps_the_promises_of_the_seam(robot: RobotProfile, simulator: SimulatorName) -> None:
    # Its own limits are lower than what the contract's straight drive asks of a Jackal.
    fast = robot.model_copy(update={"max_speed_mps": 2.0, "acc_lim_x_mps2": 10.0})
    check_simulator(
        lambda slots: make_simulator(
            simulator, slots=slots, profile=fast, settings=SimulationSettings()
        ),
        beams=robot.laser.beams,
    )


@pytest.mark.parametrize("simulator", ["batch", "bullet"])
def test_it_drives_to_its_goal_within_its_own_limits(
    robot: RobotProfile, simulator: SimulatorName
) -> None:
    driven = make_simulator(simulator, slots=1, profile=robot, settings=SimulationSettings())
    driven.reset(np.arange(1), [corridor()], np.zeros(1, dtype=np.int64))
    fastest = 0.0
    for _ in range(20):
        driven.advance(DWA_FAST.as_array()[None], 20)
        fastest = max(fastest, float(driven.state().velocities[0, 0]))
    state, scans = driven.state(), driven.scans()
    driven.close()
    assert state.outcomes.tolist() == [EpisodeOutcome.SUCCESS]
    # Asked for 1 m/s it drives as fast as it can, to within the noise of its wheels.
    assert fastest == pytest.approx(robot.max_speed_mps, rel=0.2)
    assert scans.shape == (1, robot.laser.beams)
    # 3 m from its start and 1.35 m from either wall of the corridor, it sees all of both.
    assert (scans < robot.laser.range_max_m).mean() > 0.9


def test_a_policy_of_its_own_sees_all_round_and_learns(
    robot: RobotProfile, trained: TrainingResult
) -> None:
    policy = trained.policy
    assert policy.observation == observation_for("default", robot)
    assert policy.observation.sector_max_rad == np.pi == -policy.observation.sector_min_rad
    assert trained.reason == "finished"
    assert trained.steps == 320
    untrained = train(
        [corridor()],
        parent=None,
        settings=TRAINING.model_copy(update={"steps": 1}),
        simulation=SIMULATION,
        profile=robot,
        deadline=lambda: True,
    ).policy
    for before, after in zip(untrained.weights, policy.weights, strict=True):
        assert (before != after).any()


def test_its_policy_is_measured_on_it_and_survives_its_bundle(
    robot: RobotProfile, trained: TrainingResult
) -> None:
    files = pack_bundle(
        trained.policy,
        lineage=Lineage(
            parent_id="",
            run_id="",
            algorithm="ppo",
            steps=trained.steps,
            seed=0,
            environments=1,
            trained_in="a corridor",
        ),
        profile=robot,
        simulation=SIMULATION,
        reward=reward_of(TRAINING),
    )
    bundle = unpack_bundle(files, source="test")
    assert bundle.robot == robot.name
    assert f"on a\n{robot.name}" in files["card.md"].decode()
    ours, loaded = (
        evaluate(
            {"learned": policy},
            [evaluation_task(corridor(), pair=0, profile=robot)],
            trials=2,
            seed=0,
            simulation=SIMULATION,
            profile=robot,
        )
        for policy in (trained.policy, bundle.policy)
    )
    assert ours == loaded
    assert [episode.outcome for episode in ours] == ["success", "success"]
    # 3 m until the goal is 1 m away: slower than a Jackal by its own limit.
    assert min(episode.time_s for episode in ours) > 3.0 / robot.max_speed_mps


def test_a_policy_for_another_robot_can_be_gone_on_from(robot: RobotProfile) -> None:
    jackal = observation_for("default", JACKAL)
    parent = train(
        [corridor()],
        parent=None,
        settings=TRAINING.model_copy(update={"steps": 16}),
        simulation=SIMULATION,
        profile=JACKAL,
    ).policy
    child: ParameterPolicy = train(
        [corridor()],
        parent=parent,
        settings=TRAINING.model_copy(update={"critic_share": 0.0}),
        simulation=SIMULATION,
        profile=robot,
    ).policy
    assert child.observation == parent.observation == jackal
    assert (child.weights[0] != parent.weights[0]).any()


def test_what_can_be_crossed_goes_by_its_radius(robot: RobotProfile) -> None:
    cells = np.stack([gap(width).cells for width in (3, 4, 0)])
    assert 2 * robot.inscribed_radius_m < 3 * 5.0 / 30 < 2 * JACKAL.inscribed_radius_m
    assert traversable(cells, radius=robot.inscribed_radius_m).tolist() == [True, True, False]
    assert traversable(cells, radius=JACKAL.inscribed_radius_m).tolist() == [False, True, False]


def test_it_crosses_an_environment(robot: RobotProfile) -> None:
    (episode,) = evaluate(
        {"dwa-slow": FIXED_POLICIES["dwa-slow"]},
        [evaluation_task(environment_task(gap(8)), pair=0, profile=robot)],
        trials=1,
        seed=0,
        simulation=SimulationSettings(),
        profile=robot,
    )
    assert episode.outcome == "success"
