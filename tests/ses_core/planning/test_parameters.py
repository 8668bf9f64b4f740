"""Planner parameters and the actions that stand for them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ses_core.planning.parameters import (
    DWA_FAST,
    DWA_SLOW,
    PARAMETER_HIGH,
    PARAMETER_LOW,
    PARAMETER_NAMES,
    decode_action,
    encode_parameters,
)

actions = st.lists(st.floats(-1, 1), min_size=7, max_size=7).map(np.array)


@given(actions)
def test_decoding_then_encoding_gives_the_action_back(action: np.ndarray) -> None:
    parameters = decode_action(action)
    assert (parameters >= PARAMETER_LOW).all()
    assert (parameters <= PARAMETER_HIGH).all()
    assert encode_parameters(parameters) == pytest.approx(action, abs=1e-9)


def test_an_action_out_of_bounds_is_clipped() -> None:
    assert (decode_action(np.full(7, 5.0)) == PARAMETER_HIGH).all()
    assert (decode_action(np.full(7, -5.0)) == PARAMETER_LOW).all()


def test_fast_differs_from_slow_by_twice_the_speed_and_the_sampling_alone() -> None:
    slow, fast = DWA_SLOW.as_array(), DWA_FAST.as_array()
    changed = {name for name, a, b in zip(PARAMETER_NAMES, slow, fast, strict=True) if a != b}
    assert changed == {"max_vel_x", "vx_samples"}
    assert fast[0] == 2 * slow[0]
    assert fast[2] == 2 * slow[2]
