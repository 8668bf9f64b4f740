"""Velocity window, scoring, preference for turning, oscillation and escape."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ses_core.geometry import Pose2D
from ses_core.planning.parameters import DWA_FAST, DWA_SLOW, PARAMETER_NAMES
from ses_core.planning.rollouts import rollout_cost
from ses_core.planning.trajectory_planner import (
    _best_forward,
    _end_cost,
    _escape,
    _note_oscillation,
    find_command,
    velocity_window,
)
from ses_core.simulation.robot import drive
from tests.simulated import Kernel, course, get, hall, parameters, planned, put, simulator


def test_the_window_is_what_one_period_of_acceleration_reaches() -> None:
    assert velocity_window(1.2, 0.1, 2.0, 10.0, 0.05) == pytest.approx((0.7, 1.7))
    assert velocity_window(0.3, 0.1, 0.5, 10.0, 0.05) == pytest.approx((0.1, 0.5))
    assert velocity_window(0.0, -1.57, 1.57, 20.0, 0.05) == pytest.approx((-1.0, 1.0))


def test_forward_samples_are_never_slower_than_a_tenth_even_while_reversing() -> None:
    assert velocity_window(-0.5, 0.1, 2.0, 10.0, 0.05) == pytest.approx((0.1, 0.1))
    assert velocity_window(0.0, 0.1, 0.05, 10.0, 0.05) == pytest.approx((0.1, 0.1))


def test_biases_are_per_metre() -> None:
    path = np.full((202, 202), 3, dtype=np.uint16)
    goal = np.full((202, 202), 40, dtype=np.uint16)
    cost = _end_cost(path, goal, 100.5, 100.5, DWA_SLOW.as_array())
    assert cost == pytest.approx(0.75 * 0.15 + 1.0 * 2.0)


def test_ending_where_no_way_leads_from_or_off_the_map_is_impossible() -> None:
    path = np.full((202, 202), 3, dtype=np.uint16)
    goal = np.full((202, 202), 65534, dtype=np.uint16)
    assert _end_cost(path, goal, 100.5, 100.5, DWA_SLOW.as_array()) == math.inf
    goal[:] = 1
    assert _end_cost(path, goal, 0.5, 100.5, DWA_SLOW.as_array()) == math.inf


def test_in_the_open_the_fastest_straight_sample_wins() -> None:
    k = planned(course(hall()))
    assert get(k.slot, "command_v") == pytest.approx(0.5)
    assert get(k.slot, "command_w") == 0.0


def test_the_robot_turns_in_place_towards_a_goal_behind_it() -> None:
    k = planned(course(hall(), start=Pose2D(4.5, 2.5, math.pi)))
    assert get(k.slot, "command_v") == 0.0
    assert abs(get(k.slot, "command_w")) >= 0.314


def _clutter(seed: int) -> Kernel:
    rng = np.random.default_rng(seed)
    cells = hall() | (rng.random((50, 90)) < rng.uniform(0.002, 0.03))
    cells[20:31, 5:16] = False
    k = planned(course(cells), DWA_FAST)
    put(k.slot, v=float(rng.uniform(0.0, 1.0)), w=float(rng.uniform(-1.0, 1.0)))
    put(k.slot, yaw=float(rng.uniform(-0.8, 0.8)))
    return k


def _all_costs(k: Kernel, v: float, w: float) -> float:
    """The highest cost over a roll-out, pose by pose and point by point; -1 and -2 as usual."""
    window, table = k.memory.window_distances[0], k.memory.costs[0]
    steps = max(1, math.ceil(max(abs(v), abs(w) * k.robot.circumscribed_radius) * 2.0 / 0.05))
    worst = 0.0
    left = get(k.slot, "map_x") + 0.05 * (get(k.slot, "window_column") - 1)
    bottom = get(k.slot, "map_y") + 0.05 * (get(k.slot, "window_row") - 1)
    for step in range(steps + 1):
        x, y, yaw = drive(
            get(k.slot, "x"), get(k.slot, "y"), get(k.slot, "yaw"), v, w, 2.0 * step / steps
        )
        turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        points = np.vstack([k.robot.outline @ turn.T, np.zeros((1, 2))])
        points += (x - left, y - bottom)
        columns, rows = (points / 0.05).astype(int).T
        costs = table[window[rows, columns]]
        if costs[:-1].max() == 254:
            return -1.0
        centre = rows[-1], columns[-1]
        if max(k.memory.path_steps[0][centre], k.memory.goal_steps[0][centre]) >= 65534:
            return -2.0
        worst = max(worst, float(costs.max()))
    return worst


@settings(deadline=None, max_examples=150)
@given(st.integers(0, 30), st.floats(-1.0, 1.0), st.floats(-1.5, 1.5), st.booleans())
def test_roll_outs_cost_what_their_worst_point_costs(
    seed: int, v: float, w: float, is_backwards: bool
) -> None:
    k = _clutter(seed)
    # Distances end with the map, half a metre inside the world's wall: nobody drives there.
    assume(_stays_on_the_map(k, v, w))
    found = rollout_cost(k.slot, k.memory, 0, k.robot, v, w, is_backwards, math.inf)
    expected = _all_costs(k, v, w)
    if is_backwards and expected < 0.0:
        assert found < 0.0
    else:
        # Rounding may put a point that lies on a cell's edge into its neighbour.
        assert found == expected or _is_on_an_edge(k, v, w, found)


def _stays_on_the_map(k: Kernel, v: float, w: float) -> bool:
    reach = k.robot.circumscribed_radius + 0.05
    width, height = (0.05 * get(k.slot, name) for name in ("map_width", "map_height"))
    for time in np.linspace(0.0, 2.0, 100):
        x, y, _ = drive(get(k.slot, "x"), get(k.slot, "y"), get(k.slot, "yaw"), v, w, float(time))
        along, across = x - get(k.slot, "map_x"), y - get(k.slot, "map_y")
        if not (reach < along < width - reach and reach < across < height - reach):
            return False
    return True


def _is_on_an_edge(k: Kernel, v: float, w: float, found: float) -> bool:
    return any(
        found == _all_costs(k, v + dv, w + dw)
        for dv in (-1e-7, 0.0, 1e-7)
        for dw in (-1e-7, 0.0, 1e-7)
    )


@pytest.mark.parametrize("seed", range(25))
def test_the_pruned_search_finds_what_trying_every_sample_in_order_finds(seed: int) -> None:
    k = _clutter(seed)
    chosen = DWA_FAST.as_array()
    v_low, v_high, vx_count = 0.1, 0.9, 12
    w_low, w_step, vtheta_count = -1.0, 2.0 / 19, 20
    sample, cost = _best_forward(
        k.slot, k.memory, 0, k.robot, chosen, k.scratch.samples[0],
        v_low, v_high, vx_count, w_low, w_step, vtheta_count,
    )  # fmt: skip
    best, best_cost = -1, -1.0
    for number in range(vx_count * vtheta_count):
        v = v_low + (number // vtheta_count) * (v_high - v_low) / (vx_count - 1)
        place = number % vtheta_count
        w = 0.0 if place == 0 else w_low + (place - 1) * w_step
        worst = rollout_cost(k.slot, k.memory, 0, k.robot, v, w, False, math.inf)
        if worst < 0.0:
            continue
        x, y, _ = drive(get(k.slot, "x"), get(k.slot, "y"), get(k.slot, "yaw"), v, w, 2.0)
        column = (x - get(k.slot, "map_x")) / 0.05 - get(k.slot, "window_column") + 1.0
        row = (y - get(k.slot, "map_y")) / 0.05 - get(k.slot, "window_row") + 1.0
        total = k.robot.occdist_scale * worst + _end_cost(
            k.memory.path_steps[0], k.memory.goal_steps[0], column, row, chosen
        )
        if total < math.inf and (best < 0 or total < best_cost):
            best, best_cost = number, total
    assert sample == best
    assert cost == pytest.approx(best_cost)


def test_after_turning_right_twice_turning_left_is_barred_until_moved() -> None:
    k = planned(course(hall()))
    _note_oscillation(k.slot, k.robot, 0.0, -0.5)
    assert get(k.slot, "is_rotating_right")
    assert not get(k.slot, "is_stuck_right")
    _note_oscillation(k.slot, k.robot, 0.0, -0.5)
    assert get(k.slot, "is_stuck_right")
    put(k.slot, x=get(k.slot, "x") + 0.04)
    _note_oscillation(k.slot, k.robot, 0.3, 0.0)
    assert get(k.slot, "is_stuck_right")
    put(k.slot, x=get(k.slot, "x") + 0.02)
    _note_oscillation(k.slot, k.robot, 0.3, 0.0)
    assert not get(k.slot, "is_stuck_right")
    assert not get(k.slot, "is_rotating_right")


def test_a_barred_direction_is_not_taken() -> None:
    # The goal lies behind and to the left, so turning left would be chosen.
    task = course(hall(), start=Pose2D(4.5, 2.5, 0.0), goal=(1.0, 3.5))
    free, barred = planned(task), planned(task)
    assert get(free.slot, "command_w") > 0.0
    put(barred.slot, is_stuck_right=True)
    find_command(
        barred.slot, barred.memory, 0, barred.robot, DWA_SLOW.as_array(), 0.05, barred.scratch, 0
    )
    assert get(barred.slot, "command_w") <= 0.0 or get(barred.slot, "command_v") > 0.0


def _boxed_in() -> Kernel:
    """A wall 0.15 m ahead of the bumper and pillars at both sides: neither on nor round."""
    cells = hall(resolution=0.05)
    cells[30:70, 27:30] = True
    cells[36:43, 14:30] = True
    cells[57:64, 14:30] = True
    return planned(course(cells, resolution=0.05))


def test_only_without_a_legal_sample_the_robot_backs_up() -> None:
    k = _boxed_in()
    assert get(k.slot, "command_v") == -0.5
    assert get(k.slot, "command_w") == 0.0
    assert get(k.slot, "is_escaping")


def test_an_escape_ends_after_a_tenth_of_a_metre_or_of_a_radian() -> None:
    for away, has_ended in (
        ({"x": 0.09}, False),
        ({"x": 0.11}, True),
        ({"yaw": 0.09}, False),
        ({"yaw": 0.11}, True),
    ):
        k = _boxed_in()
        put(k.slot, **{name: get(k.slot, name) - value for name, value in away.items()})
        assert _escape(k.slot, k.memory, 0, k.robot)
        assert get(k.slot, "is_escaping") != has_ended


def test_while_escaping_no_forward_sample_is_tried() -> None:
    k = planned(course(hall()))
    put(k.slot, is_escaping=True)
    find_command(k.slot, k.memory, 0, k.robot, DWA_SLOW.as_array(), 0.05, k.scratch, 0)
    assert get(k.slot, "command_v") <= 0.0


def test_where_no_way_leads_from_there_is_no_valid_command() -> None:
    k = planned(course(hall()))
    k.memory.goal_steps[0][:] = 65534
    is_valid = find_command(k.slot, k.memory, 0, k.robot, DWA_SLOW.as_array(), 0.05, k.scratch, 0)
    assert not is_valid
    assert get(k.slot, "command_v") == 0.0
    assert not get(k.slot, "is_escaping")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("max_vel_x", 1.2),
        ("max_vel_theta", 0.4),
        ("vx_samples", 12.0),
        ("vtheta_samples", 9.0),
        ("path_distance_bias", 0.1),
        ("goal_distance_bias", 0.1),
        ("inflation_radius", 0.6),
        ("occdist_scale", 0.001),
    ],
)
def test_every_parameter_acts_at_run_time(name: str, value: float) -> None:
    cells = hall()
    cells[22:30, 35:40] = True
    cells[8:16, 45:50] = True
    usual, changed = simulator(course(cells)), simulator(course(cells))
    usual.advance(parameters(1), 20)
    changed.advance(parameters(1), 20)
    assert np.array_equal(usual.state().poses, changed.state().poses)
    other = parameters(1)
    other[0, PARAMETER_NAMES.index(name)] = value
    usual.advance(parameters(1), 140)
    changed.advance(other, 140)
    assert not np.array_equal(usual.state().poses, changed.state().poses)
