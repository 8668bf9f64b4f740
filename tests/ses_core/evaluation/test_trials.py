"""Tests of paired trials in the real simulator."""

from dataclasses import replace

import numpy as np
import pytest

from ses_core.arrays import FloatArray
from ses_core.evaluation.trials import EvaluationTask, evaluate, evaluation_task
from ses_core.learning.observation import DEFAULT_OBSERVATION
from ses_core.learning.policies import FIXED_POLICIES, ParameterPolicy, random_policy
from ses_core.protocols import Policy
from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings
from tests.ses_core.learning.places import closed_room, corridor

SIMULATION = SimulationSettings(time_limit_s=40.0, stuck_time_s=10.0)

POLICIES: dict[str, Policy] = {
    "learned": random_policy(DEFAULT_OBSERVATION, (8,), rng=np.random.default_rng(0)),
    **FIXED_POLICIES,
}


def places() -> list[EvaluationTask]:
    return [
        evaluation_task(corridor(), pair=0, profile=JACKAL),
        evaluation_task(closed_room(), pair=0, profile=JACKAL),
        evaluation_task(corridor("long", length=6.0), pair=1, profile=JACKAL),
    ]


def test_episodes_do_not_depend_on_slots_or_on_the_company() -> None:
    shares: list[float] = []
    together = evaluate(
        POLICIES,
        places(),
        trials=2,
        seed=3,
        simulation=SIMULATION,
        profile=JACKAL,
        slots=4,
        run_id="night",
        progress=shares.append,
    )
    assert [episode.policy for episode in together] == [
        name for name in ("learned", "dwa-slow", "dwa-fast") for _ in range(6)
    ]
    assert [(episode.world_id, episode.trial) for episode in together[:6]] == [
        (world, trial) for world in ("corridor", "closed", "long") for trial in (0, 1)
    ]
    alone = evaluate(
        {"dwa-fast": POLICIES["dwa-fast"], "learned": POLICIES["learned"]},
        places()[::-1][:2],
        trials=2,
        seed=3,
        simulation=SIMULATION,
        profile=JACKAL,
        slots=1,
        run_id="night",
    )
    known = {episode.episode_id: episode for episode in together}
    assert len(known) == 18
    assert all(known[episode.episode_id] == episode for episode in alone)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_outcomes_times_and_scores_are_those_of_the_drive() -> None:
    episodes = evaluate(
        {"dwa-slow": POLICIES["dwa-slow"], "dwa-fast": POLICIES["dwa-fast"]},
        places()[:2],
        trials=1,
        seed=0,
        simulation=SIMULATION,
        profile=JACKAL,
    )
    slow, slow_closed, fast, fast_closed = episodes
    assert slow.outcome == fast.outcome == "success"
    # 3 m to drive until the goal is 1 m away, at 0.5 and at 1 m/s.
    assert 5.5 < slow.time_s < 8.0
    assert 2.5 < fast.time_s < 4.5
    assert slow.path_length_m == pytest.approx(3.0, abs=0.3)
    assert slow.optimal_time_s == pytest.approx(2.0, abs=0.1)
    assert slow.barn_score == pytest.approx(slow.optimal_time_s / slow.time_s)
    assert {slow_closed.outcome, fast_closed.outcome} <= {"stuck", "timeout", "collision"}
    assert slow_closed.barn_score == 0.0


def test_each_trial_has_a_seed_of_its_own_shared_by_all_policies() -> None:
    episodes = evaluate(
        FIXED_POLICIES,
        places()[:1],
        trials=3,
        seed=1,
        simulation=SIMULATION,
        profile=JACKAL,
    )
    slow, fast = episodes[:3], episodes[3:]
    assert len({episode.seed for episode in slow}) == 3
    assert [episode.seed for episode in slow] == [episode.seed for episode in fast]
    assert len({episode.path_length_m for episode in slow}) == 3


def test_a_policy_decides_as_often_as_it_was_trained_to(monkeypatch: pytest.MonkeyPatch) -> None:
    flat = random_policy(DEFAULT_OBSERVATION, (8,), rng=np.random.default_rng(0))
    flat = replace(flat, weights=tuple(0 * matrix for matrix in flat.weights))
    counts: dict[float, int] = {0.5: 0, 1.0: 0}
    act = ParameterPolicy.act

    def counted(policy: ParameterPolicy, observations: FloatArray) -> FloatArray:
        counts[policy.decision_period] += 1
        return act(policy, observations)

    monkeypatch.setattr(ParameterPolicy, "act", counted)
    often, seldom = evaluate(
        {"often": replace(flat, decision_period=0.5), "seldom": flat},
        places()[:1],
        trials=1,
        seed=0,
        simulation=SIMULATION,
        profile=JACKAL,
    )
    # One that always decides the same drives the same, however often it does.
    assert often.time_s == seldom.time_s
    assert counts == {0.5: np.ceil(often.time_s / 0.5), 1.0: np.ceil(seldom.time_s)}


def test_two_places_with_one_name_are_refused() -> None:
    twice = [places()[0], replace(places()[0], optimal_time_s=9.0)]
    with pytest.raises(ValueError, match="2 places have 1 different worlds and pairs"):
        evaluate(FIXED_POLICIES, twice, trials=1, seed=0, simulation=SIMULATION, profile=JACKAL)


def test_no_places_make_no_episodes() -> None:
    assert (
        evaluate(FIXED_POLICIES, [], trials=3, seed=0, simulation=SIMULATION, profile=JACKAL) == []
    )


def test_a_world_without_a_way_is_timed_by_the_straight_line() -> None:
    assert places()[1].optimal_time_s == pytest.approx(2.5)
