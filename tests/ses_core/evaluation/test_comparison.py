"""Tests of paired comparisons and of what may be said of them."""

from dataclasses import replace

import pytest

from ses_core.evaluation.comparison import Comparison, Verdict, compare, judge
from tests.ses_core.evaluation.episode_lists import episode, successes


def test_the_first_policy_is_compared_with_each_other_one() -> None:
    episodes = [
        *successes("new", [10.0, 20.0, 30.0]),
        *successes("old", [12.0, 22.0, 32.0]),
        *[episode("slow", f"world-{number}", "stuck", 70.0) for number in range(3)],
    ]
    old, slow = compare(episodes)
    assert (old.policy, old.baseline, slow.baseline) == ("new", "old", "slow")
    assert old.success_difference == 0.0
    assert old.time_difference_s == pytest.approx(-2.0)
    assert old.ci_s == pytest.approx((-2.0, -2.0))
    assert slow.success_difference == 1.0
    assert slow.time_difference_s == pytest.approx(20.0 - 100.0)
    assert (old.trials, old.worlds) == (3, 3)


def test_pairing_removes_what_the_worlds_have_in_common() -> None:
    times = [5.0 * number for number in range(1, 19)]
    [paired] = compare(
        [*successes("new", [time - 1.0 for time in times]), *successes("old", times)]
    )
    assert paired.ci_s is not None
    assert paired.ci_s[1] < 0.0


def test_policies_on_different_trials_are_refused() -> None:
    with pytest.raises(ValueError, match="share 1 trials, expected all of 1 and 2"):
        compare([*successes("new", [1.0]), *successes("old", [1.0, 2.0])])


CLEAR = Comparison(
    policy="new",
    baseline="old",
    success_difference=0.0,
    ci=(-0.02, 0.02),
    time_difference_s=-3.0,
    ci_s=(-5.0, -1.0),
    trials=400,
    worlds=100,
)


@pytest.mark.parametrize(
    ("comparison", "verdict"),
    [
        (CLEAR, "better"),
        (replace(CLEAR, worlds=99), "insufficient evidence"),
        (replace(CLEAR, ci=None), "insufficient evidence"),
        (replace(CLEAR, ci_s=None), "insufficient evidence"),
        (replace(CLEAR, ci_s=(-5.0, 0.1)), "no difference shown"),
        (replace(CLEAR, ci=(-0.04, 0.02)), "no difference shown"),
        (replace(CLEAR, ci_s=(0.1, 3.0)), "worse"),
        (replace(CLEAR, ci=(-0.2, -0.01)), "worse"),
    ],
)
def test_verdicts_at_their_boundaries(comparison: Comparison, verdict: Verdict) -> None:
    assert judge(comparison) == verdict
