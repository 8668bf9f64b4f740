"""The planner against numbers worked out by hand from the rules of move_base's stack.

Rules: base_local_planner's TrajectoryPlanner, rotate_recovery and move_base of ROS Melodic (1.16),
with the parameters of jackal_navigation.
"""

import math

import numpy as np
import pytest

from ses_core.geometry import Pose2D
from ses_core.planning.parameters import DWA_SLOW
from ses_core.planning.recovery import recover
from ses_core.planning.rollouts import HITS, NO_WAY, rollout_cost
from ses_core.planning.trajectory_planner import (
    _best_forward,
    _escape,
    _note_oscillation,
    _prefer_turning,
    find_command,
    velocity_window,
)
from tests.simulated import Kernel, course, get, hall, planned, put

MIDDLE = 101  # the robot's cell in its window of 202 x 202


def _plain(*, path: int = 4, goal: int = 20, squared: int = 255) -> Kernel:
    """A robot in a window where every cell is alike: steps to plan and goal, distance to a mark.

    It stands in the middle of its cell and looks along the rows.
    """
    k = planned(course(hall(), start=Pose2D(1.025, 2.525, 0.0)))
    k.memory.window_distances[0][:] = squared
    k.memory.path_steps[0][:] = path
    k.memory.goal_steps[0][:] = goal
    return k


def _cost(k: Kernel, v: float = 0.3, w: float = 0.0) -> float:
    return rollout_cost(k.slot, k.memory, 0, k.robot, v, w, False, math.inf)


def _search(k: Kernel, v_low: float, v_high: float) -> tuple[int, float]:
    """Try 2 speeds straight ahead and at the window's low end, no turn."""
    return _best_forward(
        k.slot, k.memory, 0, k.robot, DWA_SLOW.as_array(), k.scratch.samples[0],
        v_low, v_high, 2, 0.0, 0.0, 2,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("v", "goal_distance", "expected"),
    [
        # acc_lim_x 10 for 1/20 s is 0.5 either way, within [0.1, max_vel_x = 0.5].
        (0.0, 5.0, (0.1, 0.5)),
        (0.2, 5.0, (0.1, 0.5)),
        # distance / sim_time = 0.6 / 2 = 0.3 lowers the upper end ...
        (0.2, 0.6, (0.1, 0.3)),
        # ... but never below the lower end: 0.1 / 2 = 0.05 < 0.1.
        (0.0, 0.1, (0.1, 0.1)),
        # Rolling back from an escape: 0.5 + -0.5 = 0 is below min_vel_x.
        (-0.5, 5.0, (0.1, 0.1)),
        # Too fast for a lowered max_vel_x: samples go down from 1.2 - 0.5 = 0.7 to 0.5.
        (1.2, 5.0, (0.7, 0.5)),
    ],
)
def test_the_speed_window(v: float, goal_distance: float, expected: tuple[float, float]) -> None:
    highest = min(0.5, goal_distance / 2.0)
    assert velocity_window(v, 0.1, highest, 10.0, 0.05) == pytest.approx(expected)


@pytest.mark.parametrize(("away", "fastest"), [(0.6, 0.3), (0.8, 0.4), (3.0, 0.5)])
def test_the_speed_falls_towards_the_plan_s_end(away: float, fastest: float) -> None:
    k = planned(course(hall(), goal=(1.0 + away, 2.5)))
    # The plan ends within a cell of the goal.
    assert get(k.slot, "command_v") == pytest.approx(fastest, abs=0.03)


def test_a_sample_costs_path_goal_and_obstacles_with_only_the_first_two_per_metre() -> None:
    # 6 cells from a mark: floor(252 exp(-10 (0.30 - 0.265))) = floor(177.58) = 177.
    # 0.75 x 0.05 x 4 + 1.0 x 0.05 x 20 + 0.1 x 177 = 0.15 + 1.00 + 17.70
    assert _search(_plain(squared=36), 0.1, 0.5)[1] == pytest.approx(18.85)
    # Beyond the inflation radius of 6 cells nothing is left of the last term.
    assert _search(_plain(squared=37), 0.1, 0.5)[1] == pytest.approx(1.15)


def test_path_and_goal_count_at_the_end_and_obstacles_anywhere() -> None:
    k = _plain(path=0, goal=40)
    # 0.25 m/s for 2 s: 10 cells on, where 30 cells are left; 0.5 m/s: 20 cells on, 20 left.
    k.memory.goal_steps[0][:] = 40 - np.clip(np.arange(202) - MIDDLE, 0, 40).astype(np.uint16)
    best, cost = _search(k, 0.25, 0.5)
    assert best == 2
    assert cost == pytest.approx(1.0 * 0.05 * 20)
    # A mark 6 cells from where the robot stands now costs 17.7, however far it drives.
    k.memory.window_distances[0][MIDDLE - 8 : MIDDLE + 9, MIDDLE - 8 : MIDDLE + 9] = 36
    assert _search(k, 0.25, 0.5)[1] == pytest.approx(1.0 + 17.7)


def test_the_first_of_equal_samples_is_taken() -> None:
    # Slowest first, straight before turning: number 0.
    assert _search(_plain(), 0.1, 0.5)[0] == 0


def test_an_outline_may_touch_inscribed_cells_but_no_mark() -> None:
    assert _cost(_plain(squared=1)) == 253.0
    k = _plain(squared=1)
    # The front edge lies 0.21 + 0.1 m = 6.2 cells ahead of the centre, which is 0.5 in its cell.
    k.memory.window_distances[0][MIDDLE, MIDDLE + 6] = 0
    assert _cost(k, v=0.1) == HITS


def test_a_mark_inside_the_outline_is_not_a_hit_but_costs_what_it_costs() -> None:
    # The original walks the outline only, then adds the cell under the centre.
    k = _plain(squared=1)
    k.memory.window_distances[0][MIDDLE, MIDDLE] = 0
    assert _cost(k, v=0.0, w=0.4) == 254.0
    k = _plain(squared=1)
    k.memory.window_distances[0][MIDDLE, MIDDLE + 3] = 0
    assert _cost(k, v=0.0, w=0.4) == 253.0


@pytest.mark.parametrize("which", ["path_steps", "goal_steps"])
def test_a_cell_no_way_leads_from_rejects_a_sample_anywhere_on_it(which: str) -> None:
    k = _plain()
    getattr(k.memory, which)[0][:, MIDDLE + 5] = 65534
    assert _cost(k, v=0.5) == NO_WAY
    assert _cost(k, v=0.1) == 0.0
    # What comes first decides: the front edge gets to cell 9 when the centre gets to cell 2.
    k.memory.window_distances[0][:] = 1
    k.memory.window_distances[0][:, MIDDLE + 9] = 0
    assert _cost(k, v=0.5) == HITS


def _turn(k: Kernel, best_cost: float, best_v: float = 0.3) -> tuple[float, float, float]:
    # From standing still: 20 samples from -1 to 1 rad/s, 2/19 = 0.105 apart.
    return _prefer_turning(
        k.slot, k.memory, 0, k.robot, DWA_SLOW.as_array(), -1.0, 2.0 / 19, 20,
        best_cost, best_v, 0.0,
    )  # fmt: skip


def test_turning_in_place_wins_a_tie_and_loses_by_a_hair() -> None:
    tie = 0.05 * (0.75 * 4 + 1.0 * 20)
    assert _turn(_plain(), tie)[1] == 0.0
    assert _turn(_plain(), tie - 1e-9)[1] == 0.3


def test_in_place_it_never_turns_slower_than_0_314() -> None:
    k = _plain()
    # After 2 s at 0.314 it looks 36 degrees to the left: in 0.325 m at cell (5, 4).
    k.memory.goal_steps[0][MIDDLE + 3 : MIDDLE + 5, MIDDLE + 5] = 3
    cost, v, w = _turn(k, -1.0)
    assert (cost, v, w) == pytest.approx((1.15, 0.0, 0.314))


def test_of_equal_turns_the_first_is_taken_that_is_the_fastest_to_the_right() -> None:
    assert _turn(_plain(), -1.0)[2] == -1.0


def test_two_turns_the_same_way_bar_the_other_way_and_not_their_own() -> None:
    # A turn sets its `rotating` flag; the next one the same way its `stuck` flag; `stuck_right`
    # is looked at by samples that turn left (w > 0), `stuck_left` by samples that turn right.
    k = _plain()
    for w in (0.5, -0.5):
        _note_oscillation(k.slot, k.robot, 0.0, w)
    assert get(k.slot, "is_rotating_left")
    assert get(k.slot, "is_rotating_right")
    assert not get(k.slot, "is_stuck_left")
    assert not get(k.slot, "is_stuck_right")
    _note_oscillation(k.slot, k.robot, 0.0, 0.5)
    assert get(k.slot, "is_stuck_left")
    assert not get(k.slot, "is_stuck_right")
    assert _turn(k, -1.0)[2] > 0.0
    put(k.slot, is_stuck_left=False, is_stuck_right=True)
    k.memory.goal_steps[0][:MIDDLE] = 50  # it would rather look to the left
    assert _turn(k, -1.0)[2] < 0.0


def test_flags_stay_while_it_turns_on_the_spot_and_fall_after_0_05_m() -> None:
    k = _plain()
    x = get(k.slot, "x")
    for _ in range(2):
        _note_oscillation(k.slot, k.robot, 0.0, 0.5)
    # Every turn in place starts the measured way anew: 0.04 + 0.04 m are not 0.08 m.
    for _ in range(2):
        put(k.slot, x=get(k.slot, "x") + 0.04)
        _note_oscillation(k.slot, k.robot, 0.0, 0.5)
    assert get(k.slot, "is_stuck_left")
    x = get(k.slot, "x")
    put(k.slot, x=x + 0.049)
    _note_oscillation(k.slot, k.robot, 0.3, 0.5)
    assert get(k.slot, "is_stuck_left")
    put(k.slot, x=x + 0.051)
    _note_oscillation(k.slot, k.robot, 0.3, 0.5)
    assert not get(k.slot, "is_stuck_left")
    assert not get(k.slot, "is_rotating_left")


def _walled_in() -> Kernel:
    """Marks under the front and the rear edge: nothing is legal, not even to stay."""
    k = _plain()
    k.memory.window_distances[0][:] = 1
    k.memory.window_distances[0][:, [MIDDLE - 6, MIDDLE + 6]] = 0
    return k


def _find(k: Kernel) -> bool:
    return find_command(k.slot, k.memory, 0, k.robot, DWA_SLOW.as_array(), 0.05, k.scratch, 0)


def test_it_backs_up_at_escape_vel_even_into_a_mark() -> None:
    k = _walled_in()
    assert _cost(k, v=-0.5) == HITS
    assert _find(k)
    assert (get(k.slot, "command_v"), get(k.slot, "command_w")) == (-0.5, 0.0)
    assert get(k.slot, "is_escaping")
    assert get(k.slot, "escape_x") == get(k.slot, "x")


def test_an_escape_lasts_until_0_1_m_or_0_1_rad_from_where_it_began() -> None:
    for change, lasts in (
        ({"x": -0.099}, True),
        ({"x": -0.101}, False),
        ({"yaw": 0.099}, True),
        ({"yaw": -0.101}, False),
    ):
        k = _walled_in()
        assert _find(k)
        begun = get(k.slot, "escape_x")
        put(k.slot, **{name: get(k.slot, name) + by for name, by in change.items()})
        assert _escape(k.slot, k.memory, 0, k.robot)
        assert get(k.slot, "is_escaping") == lasts
        assert get(k.slot, "escape_x") == begun


def test_while_it_escapes_a_legal_turn_is_taken_and_ends_nothing_by_itself() -> None:
    k = _plain()
    put(k.slot, is_escaping=True, escape_x=get(k.slot, "x"), escape_y=get(k.slot, "y"))
    put(k.slot, escape_yaw=get(k.slot, "yaw"))
    assert _find(k)
    assert get(k.slot, "command_v") == 0.0
    assert abs(get(k.slot, "command_w")) >= 0.314
    assert get(k.slot, "is_escaping")


def _turns_of_the_recovery(k: Kernel) -> list[float]:
    rates = []
    while recover(k.slot, k.memory, 0, k.robot, 0.05):
        rates.append(get(k.slot, "command_w"))
        put(k.slot, tick=get(k.slot, "tick") + 1, w=rates[-1])
        assert len(rates) < 400
    return rates


def test_the_recovery_turns_at_max_vel_theta_to_within_the_goal_s_tolerance() -> None:
    # It reads acc_lim_theta 20, max_vel_theta 1.57, min_in_place_vel_theta 0.314 and
    # yaw_goal_tolerance 0.157 of TrajectoryPlannerROS. To stop by the end it would go
    # sqrt(2 x 20 x left), more than 1.57 as long as over 0.062 rad are left: always 1.57.
    # 2 pi - 0.157 = 6.126 rad at 1.57 / 20 = 0.0785 rad each: 78.04, so 79 commands and a stop.
    k = planned(course(hall()))
    put(k.slot, tick=301, control_tick=0, plan_tick=301)
    rates = _turns_of_the_recovery(k)
    assert rates[:-1] == [1.57] * 79
    assert rates[-1] == 0.0


@pytest.mark.parametrize(
    ("control_tick", "plan_tick", "is_due"),
    [
        (1000, 0, False),  # no plan for long, but the old one still gives valid commands
        (900, 0, False),  # both failing, planning only counts since control fails: 5 s are 100
        (899, 0, True),
        (899, 1000, False),  # a plan every tick and no command: 15 s are 300
        (700, 1000, False),
        (699, 1000, True),
    ],
)
def test_patience(control_tick: int, plan_tick: int, is_due: bool) -> None:
    # move_base gives up planning only in its state PLANNING, which a failing controller starts.
    k = planned(course(hall()))
    put(k.slot, tick=1000, control_tick=control_tick, plan_tick=plan_tick)
    assert recover(k.slot, k.memory, 0, k.robot, 0.05) == is_due
