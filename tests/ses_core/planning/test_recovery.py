"""The rotate recovery."""

import math

import pytest

from ses_core.planning.recovery import recover
from tests.simulated import course, get, hall, planned, put


def test_it_starts_after_15_s_without_a_valid_command_and_not_before() -> None:
    k = planned(course(hall()))
    put(k.slot, tick=300, control_tick=0, plan_tick=300)
    assert not recover(k.slot, k.memory, 0, k.robot, 0.05)
    put(k.slot, tick=301, plan_tick=301)
    assert recover(k.slot, k.memory, 0, k.robot, 0.05)
    assert get(k.slot, "command_v") == 0.0
    assert get(k.slot, "command_w") == 1.57


def test_it_starts_after_5_s_without_a_plan_and_a_command() -> None:
    k = planned(course(hall()))
    put(k.slot, tick=101, control_tick=0, plan_tick=0)
    assert recover(k.slot, k.memory, 0, k.robot, 0.05)


def test_it_turns_once_around_and_gives_control_back() -> None:
    k = planned(course(hall()))
    put(k.slot, tick=400, control_tick=0, plan_tick=400)
    turned = 0.0
    rates = []
    while recover(k.slot, k.memory, 0, k.robot, 0.05):
        put(k.slot, tick=get(k.slot, "tick") + 1, w=get(k.slot, "command_w"))
        rates.append(get(k.slot, "command_w"))
        turned += 0.05 * get(k.slot, "w")
        assert len(rates) < 400
    assert turned == pytest.approx(2.0 * math.pi - 0.157, abs=0.1)
    assert max(rates) == 1.57
    assert min(rate for rate in rates if rate > 0.0) >= 0.314
    assert rates[-1] == 0.0
    assert get(k.slot, "control_tick") >= 400


def test_it_is_given_up_where_the_turning_footprint_would_hit() -> None:
    cells = hall()
    cells[28:30, 5:20] = True
    cells[20:22, 5:20] = True
    k = planned(course(cells))
    put(k.slot, tick=301, control_tick=0, plan_tick=301)
    assert recover(k.slot, k.memory, 0, k.robot, 0.05)
    assert get(k.slot, "command_w") == 0.0
    assert get(k.slot, "recovery_angle") == 0.0
