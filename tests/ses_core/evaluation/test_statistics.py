"""Tests of the summary of episodes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ses_core.evaluation.statistics import rate_interval, ratio_interval, summarize
from tests.ses_core.evaluation.episode_lists import episode, successes


def test_rates_and_times_of_a_drawn_evaluation() -> None:
    episodes = [
        episode("a", "w0", "success", 20.0),
        episode("a", "w0", "collision", 5.0, trial=1),
        episode("a", "w1", "success", 30.0),
        episode("a", "w1", "timeout", 100.0, trial=1),
        episode("a", "w2", "stuck", 60.0),
    ]
    [row] = summarize(episodes)
    assert row.success_rate == pytest.approx(0.4)
    assert (row.collision_rate, row.timeout_rate, row.stuck_rate) == pytest.approx((0.2,) * 3)
    assert row.mean_time_s == pytest.approx(25.0)
    assert row.restricted_mean_time_s == pytest.approx((20 + 30 + 300) / 5)
    assert row.barn_score == pytest.approx((5 / 20 + 5 / 30) / 5)
    assert (row.trials, row.worlds) == (5, 3)


def test_policies_keep_the_order_in_which_they_appear() -> None:
    episodes = [*successes("z", [1.0, 2.0]), *successes("a", [1.0, 2.0])]
    assert [row.policy for row in summarize(episodes)] == ["z", "a"]


def test_without_a_success_there_is_no_mean_time() -> None:
    [row] = summarize([episode("a", f"w{number}", "stuck", 50.0) for number in range(3)])
    assert row.mean_time_s is None
    assert row.mean_time_ci_s is None
    assert row.restricted_mean_time_s == 100.0
    assert row.success_ci is not None
    assert row.success_ci[0] == 0.0
    assert 0.3 < row.success_ci[1] < 0.8


def test_one_world_gives_no_interval() -> None:
    [row] = summarize(successes("a", [10.0], trials=20))
    assert row.success_ci is None
    assert row.restricted_mean_time_ci_s is None


def test_repeats_in_the_same_worlds_do_not_narrow_an_interval() -> None:
    times = [10.0, 20.0, 30.0, 40.0]
    [once] = summarize(successes("a", times))
    [often] = summarize(successes("a", times, trials=50))
    assert once.mean_time_ci_s == pytest.approx(often.mean_time_ci_s)


def test_more_worlds_narrow_an_interval() -> None:
    [few] = summarize(successes("a", [10.0, 40.0] * 4))
    [many] = summarize(successes("a", [10.0, 40.0] * 100))
    assert few.mean_time_ci_s is not None
    assert many.mean_time_ci_s is not None
    assert np.ptp(many.mean_time_ci_s) < 0.3 * np.ptp(few.mean_time_ci_s)


def test_equal_seeds_give_equal_intervals() -> None:
    episodes = successes("a", [10.0 + number**1.7 for number in range(15)])
    assert summarize(episodes, seed=1) == summarize(episodes, seed=1)
    assert summarize(episodes, seed=1) != summarize(episodes, seed=2)


def test_the_interval_covers_the_truth_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(5)
    covered = 0
    for number in range(100):
        world_rates = rng.beta(4, 1, size=40)
        hits = (rng.random((40, 5)) < world_rates[:, None]).astype(float).ravel()
        worlds = np.repeat([f"w{world}" for world in range(40)], 5)
        interval = ratio_interval(hits, np.ones(200), list(worlds), seed=number)
        assert interval is not None
        covered += interval[0] <= 0.8 <= interval[1]
    # 95 % of 100, less what few clusters cost a percentile interval.
    assert 86 <= covered <= 99


@settings(max_examples=30, deadline=None)
@given(st.lists(st.booleans(), min_size=2, max_size=30))
def test_a_share_lies_within_its_interval(outcomes: list[bool]) -> None:
    hits = np.array(outcomes, dtype=float)
    interval = rate_interval(hits, [f"w{number}" for number in range(len(hits))], seed=0)
    assert interval is not None
    assert 0.0 <= interval[0] <= hits.mean() <= interval[1] <= 1.0
    assert interval[0] < interval[1]
