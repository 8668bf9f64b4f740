"""Tests of verified difficulty: places driven again, and what a training makes of it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ses_core.arrays import BoolArray
from ses_core.evaluation.difficulty import (
    VerifiedDifficulty,
    approach_heading,
    difficulties,
    draw_weights,
    simulated_count,
    verify,
)
from ses_core.geometry import Pose2D
from ses_core.learning.policies import FIXED_POLICIES
from ses_core.navigation import NavigationEnvironment
from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings
from tests.ses_core.evaluation.episode_lists import episode

SIMULATION = SimulationSettings(time_limit_s=30.0, stuck_time_s=15.0)


def environment(name: str, cells: BoolArray | None = None) -> NavigationEnvironment:
    shape = np.zeros((30, 30), dtype=np.bool_) if cells is None else cells
    return NavigationEnvironment(
        environment_id=name, cells=shape, observed=np.ones_like(shape), origin="scan"
    )


def wall() -> BoolArray:
    """A wall right across, which nobody gets through."""
    cells = np.zeros((30, 30), dtype=np.bool_)
    cells[14:16] = True
    return cells


def found(
    name: str, *, success: float = 1.0, negative: float = 0.0, time: float = 10.0
) -> VerifiedDifficulty:
    return VerifiedDifficulty(
        environment_id=name,
        policy_id="p",
        trials=3,
        negative_velocity_count=negative,
        not_forward_count=negative + 4.0,
        success_rate=success,
        restricted_mean_time_s=time,
    )


def run(
    environments: Sequence[NavigationEnvironment], headings: Mapping[str, float] | None = None
) -> list[VerifiedDifficulty]:
    return verify(
        environments,
        FIXED_POLICIES["dwa-slow"],
        policy_id="dwa-slow",
        headings=headings or {},
        trials=2,
        seed=1,
        simulation=SIMULATION,
        profile=JACKAL,
    )


def test_an_empty_place_is_easy_and_a_walled_one_is_not() -> None:
    empty, blocked = run([environment("empty"), environment("blocked", wall())])
    assert (empty.environment_id, empty.policy_id, empty.trials) == ("empty", "dwa-slow", 2)
    assert empty.is_easy
    assert empty.restricted_mean_time_s < 15.0
    assert blocked.success_rate == 0.0
    assert blocked.restricted_mean_time_s == 100.0
    assert blocked.not_forward_count > 50.0
    assert blocked.not_forward_count >= blocked.negative_velocity_count
    assert not blocked.is_easy


def test_what_is_found_of_a_place_depends_on_none_beside_it() -> None:
    alone = run([environment("blocked", wall())])
    assert run([environment("empty"), environment("blocked", wall())])[1:] == alone


def test_a_place_is_entered_as_it_was_in_the_log() -> None:
    ahead, back = run([environment("ahead"), environment("back")], {"back": math.pi})
    assert back.success_rate == 1.0
    assert back.restricted_mean_time_s > ahead.restricted_mean_time_s + 1.0
    assert back.not_forward_count > ahead.not_forward_count


def test_the_approach_is_measured_from_the_way_to_the_goal() -> None:
    for turn in (0.0, 1.0, -3.0, math.pi):
        start = Pose2D(3.0, -2.0, 2.5 + turn)
        goal = (3.0 + 5.0 * math.cos(2.5), -2.0 + 5.0 * math.sin(2.5))
        found = approach_heading(start, goal)
        assert math.cos(found - turn) == pytest.approx(1.0)
        assert -math.pi <= found <= math.pi


def test_no_place_is_driven_in_for_nothing() -> None:
    assert run([]) == []


def test_trials_are_averaged_and_a_failure_takes_the_cap() -> None:
    first = replace(episode("a", "w", "success", 20.0), negative_velocity_count=7)
    second = replace(episode("a", "w", "collision", 3.0, trial=1), not_forward_count=1)
    other = episode("a", "v", "success", 9.0)
    averaged, beside = difficulties([first, other, second])
    assert averaged == VerifiedDifficulty(
        environment_id="w",
        policy_id="a",
        trials=2,
        negative_velocity_count=5.0,
        not_forward_count=3.0,
        success_rate=0.5,
        restricted_mean_time_s=60.0,
    )
    assert (beside.environment_id, beside.restricted_mean_time_s) == ("v", 9.0)


def test_every_count_of_a_log_has_a_simulated_counterpart() -> None:
    one = found("a", negative=40.0)
    assert simulated_count(one, "negative", period=0.05) == 40.0
    assert simulated_count(one, "not-forward", period=0.05) == 44.0
    assert simulated_count(one, "reversing-seconds", period=0.05) == 2.0


def test_a_training_that_ignores_difficulty_needs_none() -> None:
    assert draw_weights([environment("a")], [], "ignore") is None


@given(times=st.lists(st.floats(0.5, 100.0), min_size=1, max_size=8))
def test_weights_follow_the_time_and_leave_no_place_out(times: list[float]) -> None:
    rows = [found(str(number), time=time) for number, time in enumerate(times)]
    places = [environment(row.environment_id) for row in rows]
    weights = draw_weights(places, rows[::-1], "weigh")
    assert weights is not None
    np.testing.assert_allclose(weights, 0.2 + np.array(times) / 100.0)


def test_only_what_is_always_crossed_without_backing_up_is_filtered_out() -> None:
    rows = [
        found("easy"),
        found("fails", success=2 / 3),
        found("backs", negative=1 / 3),
        found("slow", time=60.0),
    ]
    places = [environment(row.environment_id) for row in rows]
    weights = draw_weights(places, rows, "filter")
    assert weights is not None
    assert weights.tolist() == [0.0, 1.0, 1.0, 0.0]
    assert draw_weights(places[:1], rows, "filter") is None


def test_an_environment_nobody_drove_in_is_refused() -> None:
    with pytest.raises(ValueError, match=r"of 1 of 2 environments.*e\.g\. of b"):
        draw_weights([environment("a"), environment("b")], [found("a")], "weigh")
