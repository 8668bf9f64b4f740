"""Agreement of paired trials, by hand and against scikit-learn."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.metrics import cohen_kappa_score

from ses_core.evaluation.episodes import Episode
from ses_core.evaluation.fidelity import cohen_kappa, fidelity, ranking

OUTCOMES = ("success", "collision", "timeout", "stuck")


def _episode(trial: int, outcome: str, time: float, count: int, policy: str = "a") -> Episode:
    return Episode(
        episode_id=f"{policy}{trial}",
        run_id="",
        policy=policy,
        world_id="w",
        pair=0,
        trial=trial,
        seed=trial,
        outcome=outcome,
        time_s=time,
        path_length_m=1.0,
        optimal_time_s=1.0,
        barn_score=0.0,
        negative_velocity_count=count,
        not_forward_count=count,
        simulator="batch",
        start_x_m=0.0,
        start_y_m=0.0,
        start_yaw_rad=0.0,
        goal_x_m=1.0,
        goal_y_m=0.0,
    )


def test_by_hand() -> None:
    first = [
        _episode(0, "success", 10.0, 1),
        _episode(1, "success", 20.0, 2),
        _episode(2, "stuck", 40.0, 9),
    ]
    second = [
        _episode(0, "success", 11.0, 0),
        _episode(1, "stuck", 40.0, 5),
        _episode(2, "stuck", 40.0, 7),
    ]
    found = fidelity(first, second)
    assert found.trials == 3
    assert found.agreement == pytest.approx(2 / 3)
    # By chance: 2/3 * 1/3 + 1/3 * 2/3 = 4/9.
    assert found.kappa == pytest.approx((2 / 3 - 4 / 9) / (5 / 9))
    assert found.time_ratio == pytest.approx(1.1)
    assert found.count_correlation == pytest.approx(1.0)
    assert found.same_ranking


@given(st.lists(st.tuples(st.sampled_from(OUTCOMES), st.sampled_from(OUTCOMES)), min_size=2))
def test_kappa_is_scikit_learn_s(pairs: list[tuple[str, str]]) -> None:
    first, second = np.array(pairs).T
    if len(np.union1d(first, second)) == 1:
        assert cohen_kappa(first, second) == 1.0
    else:
        assert cohen_kappa(first, second) == pytest.approx(cohen_kappa_score(first, second))


def test_policies_rank_by_success_then_by_time() -> None:
    slow = [_episode(k, "success", 30.0, 0, "slow") for k in range(2)]
    fast = [_episode(k, "success", 20.0, 0, "fast") for k in range(2)]
    poor = [_episode(0, "success", 5.0, 0, "poor"), _episode(1, "collision", 5.0, 0, "poor")]
    assert ranking([*poor, *slow, *fast]) == ("fast", "slow", "poor")
    turned = [replace(episode, time_s=40.0) for episode in fast]
    assert not fidelity([*slow, *fast], [*slow, *turned]).same_ranking


def test_different_trials_cannot_be_compared() -> None:
    with pytest.raises(ValueError, match="different trials"):
        fidelity([_episode(0, "success", 1.0, 0)], [_episode(1, "success", 1.0, 0)])
