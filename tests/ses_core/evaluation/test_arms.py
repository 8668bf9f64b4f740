"""Tests of comparisons of arms, whose seeds and worlds are both drawn."""

import itertools

import numpy as np
import pytest

from ses_core.evaluation.arms import compare_arms, worlds_needed
from ses_core.evaluation.episodes import Episode
from tests.ses_core.evaluation.episode_lists import episode, successes


def driven(times: dict[str, list[float]]) -> list[Episode]:
    return [one for name, row in times.items() for one in successes(name, row)]


def test_the_difference_is_that_of_the_means_over_seeds() -> None:
    episodes = driven({"a-0": [10.0, 20.0], "a-1": [14.0, 24.0], "b": [20.0, 20.0]})
    found = compare_arms(episodes, ["a-0", "a-1"], ["b"])
    assert found.time_difference_s == pytest.approx((12 + 22) / 2 - 20)
    assert found.success_difference == 0.0
    assert (found.our_seeds, found.their_seeds, found.worlds, found.trials) == (2, 1, 2, 2)
    assert found.time_deviation_s == pytest.approx(np.std([12 - 20, 22 - 20], ddof=1))


def test_exchanging_the_arms_changes_the_sign_alone() -> None:
    episodes = driven({"a-0": [10.0, 21.0, 9.0], "a-1": [14.0, 24.0, 7.0], "b": [20.0, 22.0, 8.0]})
    episodes += [episode(name, "world-9", "stuck", 60.0) for name in ("a-0", "b")]
    episodes += [episode("a-1", "world-9", "success", 60.0)]
    there = compare_arms(episodes, ["a-0", "a-1"], ["b"])
    back = compare_arms(episodes, ["b"], ["a-0", "a-1"])
    assert there.success_difference == pytest.approx(0.125)
    assert back.success_difference == -there.success_difference
    assert back.time_difference_s == -there.time_difference_s
    assert back.ci_s == pytest.approx((-there.ci_s[1], -there.ci_s[0]), abs=0.3)


def test_intervals_are_those_of_every_possible_draw() -> None:
    times = {"a-0": [10.0, 20.0, 33.0], "a-1": [16.0, 21.0, 30.0], "b": [19.0, 25.0, 31.0]}
    found = compare_arms(driven(times), ["a-0", "a-1"], ["b"])
    everything = [
        np.mean([times[one][world] - times["b"][world] for one in seeds for world in worlds])
        for seeds in itertools.product(["a-0", "a-1"], repeat=2)
        for worlds in itertools.product(range(3), repeat=3)
    ]
    low, high = np.quantile(everything, (0.025, 0.975))
    assert found.ci_s == pytest.approx((low, high), abs=0.6)


def test_seeds_that_differ_widen_the_interval() -> None:
    alike = {f"a-{seed}": [10.0, 12.0, 11.0, 9.0] for seed in range(3)}
    apart = {
        f"a-{seed}": [x + 4.0 * (seed - 1) for x in row] for seed, row in enumerate(alike.values())
    }
    other = {"b": [12.0, 14.0, 13.0, 11.0]}
    narrow = compare_arms(driven(alike | other), list(alike), ["b"])
    wide = compare_arms(driven(apart | other), list(apart), ["b"])
    assert narrow.ci_s == pytest.approx((-2.0, -2.0))
    assert wide.ci_s[0] < -4.0
    assert wide.ci_s[1] > 0.0


def test_the_interval_holds_the_truth_as_often_as_it_says() -> None:
    rng = np.random.default_rng(3)
    held = 0
    for repeat in range(60):
        worlds = rng.normal(0.0, 3.0, 15)
        times = {
            f"{arm}-{seed}": 40.0 + (arm == "a") * -2.0 + rng.normal(0.0, 1.5) + row
            for arm in "ab"
            for seed in range(3)
            for row in [worlds + rng.normal(0.0, 2.0, 15)]
        }
        found = compare_arms(
            driven({name: row.tolist() for name, row in times.items()}),
            ["a-0", "a-1", "a-2"],
            ["b-0", "b-1", "b-2"],
            seed=repeat,
        )
        held += found.ci_s[0] <= -2.0 <= found.ci_s[1]
    # Three seeds say little of how much seeds differ: the interval is somewhat too narrow.
    assert held >= 48


def test_policies_on_different_trials_and_single_worlds_are_refused() -> None:
    with pytest.raises(ValueError, match="b and a share 1 trials"):
        compare_arms(driven({"a": [1.0], "b": [1.0, 2.0]}), ["a"], ["b"])
    with pytest.raises(ValueError, match="1 worlds were driven in"):
        compare_arms(driven({"a": [1.0], "b": [1.0]}), ["a"], ["b"])


def test_worlds_needed_follow_the_normal_approximation() -> None:
    assert worlds_needed(10.0, 2.0) == int(np.ceil((2.801581 * 5) ** 2))
    assert worlds_needed(10.0, 1.0) == pytest.approx(4 * worlds_needed(10.0, 2.0), abs=4)
