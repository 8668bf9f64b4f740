"""Tests of which planner parameters an action stands for."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from ses_core.learning.action import EIGHT, SEVEN, ActionParameter, ActionSpec
from ses_core.planning.parameters import DWA_SLOW, PARAMETER_NAMES

actions = st.lists(st.floats(-1, 1), min_size=8, max_size=8).map(lambda row: np.array([row]))


@pytest.mark.parametrize("spec", [SEVEN, EIGHT])
@given(action=actions)
def test_encoding_takes_back_what_decoding_did(spec: ActionSpec, action: np.ndarray) -> None:
    own = action[:, : spec.length]
    parameters = spec.decode(own)
    assert parameters.shape == (1, len(PARAMETER_NAMES))
    for one in spec.parameters:
        value = parameters[0, PARAMETER_NAMES.index(one.name)]
        assert one.low * (1 - 1e-12) <= value <= one.high * (1 + 1e-12)
    assert spec.encode(parameters) == pytest.approx(own, abs=1e-9)


def test_an_action_out_of_bounds_is_clipped() -> None:
    high, low = SEVEN.decode(np.full((1, 7), 5.0)), SEVEN.decode(np.full((1, 7), -5.0))
    assert high[0, :7].tolist() == [one.high for one in SEVEN.parameters]
    assert low[0, :7].tolist() == [one.low for one in SEVEN.parameters]


def test_what_is_not_set_is_left_as_it_is() -> None:
    one = ActionSpec(name="speed", parameters=(SEVEN.parameters[0],))
    decoded = one.decode(np.zeros((3, 1)))
    assert (decoded[:, 0] == 1.1).all()
    np.testing.assert_array_equal(decoded[:, 1:], np.tile(DWA_SLOW.as_array()[1:], (3, 1)))


def test_the_middle_of_a_logarithmic_scale_is_the_geometric_mean() -> None:
    weight = EIGHT.decode(np.zeros((1, 8)))[0, 7]
    assert weight == pytest.approx(np.sqrt(0.001 * 0.2))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"name": "max_vel_y", "low": 0.0, "high": 1.0}, "no parameter 'max_vel_y'"),
        ({"name": "max_vel_x", "low": 1.0, "high": 1.0}, "expected the first to be less"),
        ({"name": "max_vel_x", "low": 0.0, "high": 1.0, "scale": "log"}, "more than 0"),
    ],
)
def test_what_cannot_be_set_is_refused(values: dict[str, object], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        ActionParameter.model_validate(values)
