"""Tests of the vector form against what one environment does."""

from typing import Any

import numpy as np
import pytest

from ses_core.arrays import FloatArray
from ses_core.learning.action import SEVEN
from ses_core.learning.decision_process import DecisionProcess
from ses_core.learning.navigation_env import NavigationEnv
from ses_core.learning.observation import DEFAULT_OBSERVATION
from ses_core.learning.vector_env import REWARD_SCALE, VectorNavigationEnv
from ses_core.navigation import NavigationTask
from ses_core.protocols import Simulator
from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings, TrainingSettings
from ses_core.simulation.factory import make_simulator
from tests.ses_core.learning.places import closed_room, corridor

EVEN = np.zeros((6, 7), dtype=np.float32)


def make_env(
    tasks: list[NavigationTask], *, seed: int = 0, weights: FloatArray | None = None
) -> VectorNavigationEnv:
    process = DecisionProcess(
        make_simulator(
            "batch", slots=6, profile=JACKAL, settings=SimulationSettings(stuck_time_s=6.0)
        ),
        tasks=tasks,
        observation=DEFAULT_OBSERVATION,
        action=SEVEN,
        profile=JACKAL,
        settings=TrainingSettings(),
        weights=weights,
    )
    return VectorNavigationEnv(process, rng=np.random.default_rng(seed))


def drive(env: VectorNavigationEnv, decisions: int) -> tuple[FloatArray, list[dict[str, Any]]]:
    """Rewards (decisions, N) of even parameters, and the infos of finished episodes."""
    env.reset()
    steps = [env.step(EVEN) for _ in range(decisions)]
    rewards = np.array([step[1] for step in steps], dtype=np.float64)
    return rewards, [info for step in steps for info in step[3] if info]


def test_finished_slots_start_over_and_report_their_episode() -> None:
    env = make_env([corridor()])
    rewards, infos = drive(env, 12)
    assert len(infos) >= 12
    assert {info["outcome"] for info in infos} == {"success"}
    for info in infos:
        assert 22.5 <= info["episode"]["r"] <= 24.0
        assert info["episode"]["l"] == np.ceil(info["episode"]["t"] - 1e-9)
        # What was seen last is near the goal, what is seen next is a start again.
        # By what the robot believes, which drifts by a share of its way.
        assert info["terminal_observation"][121] * 10.0 + 5.0 < 1.0 + 0.1
    assert np.asarray(env.step(EVEN)[0])[:, 121].max() * 10.0 + 5.0 < 4.2
    assert rewards.sum() == pytest.approx(REWARD_SCALE * 23.3 * len(infos), rel=0.2)


def test_a_slot_drives_and_is_rewarded_as_one_environment_is() -> None:
    settings = SimulationSettings(stuck_time_s=6.0)

    def one_slot() -> Simulator:
        return make_simulator("batch", slots=1, profile=JACKAL, settings=settings)

    process = DecisionProcess(
        one_slot(),
        tasks=[corridor()],
        observation=DEFAULT_OBSERVATION,
        action=SEVEN,
        profile=JACKAL,
        settings=TrainingSettings(),
    )
    vector = VectorNavigationEnv(process, rng=np.random.default_rng(5))
    single = NavigationEnv(one_slot(), tasks=[corridor()])
    np.testing.assert_array_equal(np.asarray(vector.reset())[0], single.reset(seed=5)[0])
    done = False
    while not done:
        seen, (reward,), (done,), (info,) = vector.step(EVEN[:1])
        alone, full_reward, terminated, _, _ = single.step(EVEN[0])
        assert done == terminated
        assert reward == pytest.approx(REWARD_SCALE * full_reward, rel=1e-5)
        last = info.get("terminal_observation", np.asarray(seen)[0])
        np.testing.assert_array_equal(last, alone)
    assert info["outcome"] == "success"


def test_equal_seeds_give_equal_drives_and_other_seeds_others() -> None:
    first, again, other = (drive(make_env([corridor()], seed=seed), 4)[0] for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_starts_are_turned_and_shifted() -> None:
    seen = make_env([corridor()]).reset()
    assert len(np.unique(seen[:, 120])) == 6


def test_weights_decide_how_often_a_task_is_drawn() -> None:
    env = make_env([corridor(), closed_room()], weights=np.array([0.0, 5.0]))
    _, infos = drive(env, 14)
    assert infos
    assert "success" not in {info["outcome"] for info in infos}


def test_slots_have_nothing_of_their_own() -> None:
    env = make_env([corridor()])
    assert env.env_is_wrapped(object) == [False] * 6
    assert env.get_attr("num_envs", indices=[0, 1]) == [6, 6]
    with pytest.raises(ValueError, match="no attribute 'x'"):
        env.set_attr("x", 1)
    with pytest.raises(ValueError, match="no method 'x'"):
        env.env_method("x")
