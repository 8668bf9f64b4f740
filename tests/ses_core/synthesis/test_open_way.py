import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from numpy.random import default_rng

from ses_core.arrays import BoolArray
from ses_core.robot_profile import JACKAL
from ses_core.synthesis.open_way import OpenWay
from ses_core.synthesis.traversability import traversable

RADIUS = JACKAL.inscribed_radius_m


def draw(wanted: BoolArray, *, radius: float = RADIUS) -> BoolArray:
    """Offer every cell of environments (N, 30, 30) in reading order; give what was taken."""
    way = OpenWay(len(wanted), radius=radius)
    taken = np.zeros_like(wanted)
    for row in range(30):
        for column in range(30):
            taken[:, row, column] = way.occupy(row, column, wanted[:, row, column])
    return taken


@given(
    seed=st.integers(0, 2**32),
    share=st.floats(0.02, 0.9),
    radius=st.floats(0.05, 0.45),
)
@hypothesis_settings(max_examples=40, deadline=None)
def test_a_cell_is_left_out_only_if_it_would_close_the_way(
    seed: int, share: float, radius: float
) -> None:
    wanted = default_rng(seed).random((4, 30, 30)) < share
    taken = draw(wanted, radius=radius)
    assert traversable(taken, radius=radius).all()
    assert not (taken & ~wanted).any()
    for number, row, column in zip(*np.nonzero(wanted & ~taken), strict=True):
        before = taken[number].copy()
        before[row, column + 1 :] = False
        before[row + 1 :] = False
        before[row, column] = True
        assert not traversable(before[None], radius=radius)[0]


def test_what_can_be_crossed_is_drawn_as_it_is() -> None:
    wanted = default_rng(0).random((300, 30, 30)) < 0.05
    wanted = wanted[traversable(wanted, radius=RADIUS)]
    assert len(wanted) > 20
    assert np.array_equal(draw(wanted), wanted)


def test_a_radius_that_cannot_be_decided_exactly_is_refused() -> None:
    with pytest.raises(ValueError, match=r"inscribed radius of 0\.600 m"):
        OpenWay(1, radius=0.6)
