"""The fewest cleared cells, against brute force and an integer program; and what repair keeps."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import ndimage
from scipy.optimize import Bounds, LinearConstraint, milp

from ses_core.arrays import BoolArray, IntArray
from ses_core.robot_profile import JACKAL
from ses_core.synthesis.repair import TOO_MANY, repair
from ses_core.synthesis.traversability import traversable
from tests.ses_core.synthesis.places import rooms, walled_off

RADIUS = JACKAL.inscribed_radius_m
RADII = [0.12, 0.2, RADIUS, 0.35, 0.45]
SEEDS = st.integers(0, 2**32 - 1)


def speckled(seed: int) -> BoolArray:
    """Draw a place (30, 30) of blobs and speckle, as an early GAN does."""
    rng = np.random.default_rng(seed)
    heights = ndimage.gaussian_filter(rng.standard_normal((30, 30)), rng.uniform(0.8, 2.5))
    is_blob = heights > np.quantile(heights, 1.0 - rng.uniform(0.05, 0.45))
    cells: BoolArray = is_blob ^ (rng.random((30, 30)) < rng.uniform(0.0, 0.06))
    return cells


def mended(cells: BoolArray, radius: float = RADIUS) -> tuple[BoolArray, int]:
    repaired, cleared = repair(cells[None], radius=radius, most=900)
    return repaired[0], int(cleared[0])


def can_cross(cells: BoolArray, radius: float = RADIUS) -> bool:
    return bool(traversable(cells[None], radius=radius)[0])


def without(cells: BoolArray, chosen: IntArray) -> BoolArray:
    """Clear chosen sets (S, K) of the occupied cells, numbered in their order: (S, 30, 30)."""
    stack = np.repeat(cells[None], len(chosen), axis=0).reshape(len(chosen), -1)
    occupied = np.flatnonzero(cells)
    for number, row in enumerate(stack):
        row[occupied[chosen[number]]] = False
    return stack.reshape(-1, 30, 30)


def fewest_by_integer_program(cells: BoolArray, radius: float) -> int:
    """Solve for the fewest cleared cells, asking nothing but whether the disc can cross.

    Whenever it cannot, cells are taken away that still block it without the others; one of
    these has to be cleared.
    """
    occupied = np.flatnonzero(cells)
    blockers: list[BoolArray] = []
    chosen = np.zeros(0, dtype=np.int64)
    while not can_cross(left := without(cells, chosen[None])[0], radius):
        for cell in np.random.default_rng(len(blockers)).permutation(occupied):
            fewer = left.copy()
            fewer.flat[cell] = False
            if not can_cross(fewer, radius):
                left = fewer
        blockers.append(left.flat[occupied])
        solved = milp(
            np.ones(len(occupied)),
            integrality=np.ones(len(occupied), dtype=np.int64),
            bounds=Bounds(0, 1),
            constraints=LinearConstraint(np.array(blockers, dtype=float), lb=1.0),
        )
        assert solved.x is not None
        chosen = np.flatnonzero(solved.x > 0.5)
    return len(chosen)


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from(RADII))
def test_no_smaller_set_of_cells_would_do(seed: int, radius: float) -> None:
    rng = np.random.default_rng(seed)
    cells = np.zeros((30, 30), dtype=np.bool_)
    for row in rng.integers(0, 30, rng.integers(1, 3)):
        cells[row, :: rng.integers(2, 4)] = True
    cells &= rng.random((30, 30)) < 0.95
    cells[tuple(rng.integers(0, 30, (2, 8)))] = True
    _, cleared = mended(cells, radius)
    assume(1 <= cleared <= 3)
    occupied = int(cells.sum())
    smaller = np.array([*combinations(range(occupied), cleared - 1)], dtype=np.int64)
    assert not traversable(without(cells, smaller), radius=radius).any()


@pytest.mark.parametrize(
    ("seed", "radius"), [*((seed, RADIUS) for seed in range(6)), (2, 0.2), (2, 0.4), (4, 0.4)]
)
def test_speckle_is_repaired_with_as_few_cells_as_an_integer_program_needs(
    seed: int, radius: float
) -> None:
    cells = speckled(seed)
    assert mended(cells, radius)[1] == fewest_by_integer_program(cells, radius)


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.sampled_from(RADII))
def test_a_repaired_place_can_be_crossed_and_only_occupied_cells_were_cleared(
    seed: int, radius: float
) -> None:
    cells = speckled(seed)
    repaired, cleared = mended(cells, radius)
    assert can_cross(repaired, radius)
    assert not (repaired & ~cells).any()
    assert (cells & ~repaired).sum() == cleared
    assert (cleared == 0) == can_cross(cells, radius)


@settings(max_examples=60, deadline=None)
@given(SEEDS)
def test_every_cleared_cell_is_needed(seed: int) -> None:
    cells = speckled(seed)
    repaired, _ = mended(cells)
    put_back = np.flatnonzero(cells & ~repaired)
    stack = np.repeat(repaired[None], len(put_back), axis=0)
    stack.reshape(-1, 900)[np.arange(len(put_back)), put_back] = True
    assert not traversable(stack, radius=RADIUS).any()


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.sampled_from(RADII))
def test_mirrored_and_turned_places_need_equally_many_cells(seed: int, radius: float) -> None:
    cells = speckled(seed)
    needed = mended(cells, radius)[1]
    assert mended(cells[:, ::-1].copy(), radius)[1] == needed
    assert mended(cells[::-1, ::-1].copy(), radius)[1] == needed


@settings(max_examples=60, deadline=None)
@given(SEEDS, st.floats(0.05, 0.49), st.floats(0.05, 0.49))
def test_a_larger_disc_never_needs_fewer_cells(seed: int, first: float, second: float) -> None:
    cells = speckled(seed)
    smaller, larger = sorted((first, second))
    assert mended(cells, smaller)[1] <= mended(cells, larger)[1]


@given(SEEDS, st.integers(0, 20))
@settings(max_examples=40, deadline=None)
def test_what_needs_too_many_cells_is_left_as_it_is(seed: int, most: int) -> None:
    cells = speckled(seed)
    needed = mended(cells)[1]
    repaired, cleared = repair(cells[None], radius=RADIUS, most=most)
    if needed > most:
        assert cleared[0] == TOO_MANY
        assert np.array_equal(repaired[0], cells)
    else:
        assert cleared[0] == needed


def test_a_stack_is_repaired_one_by_one_and_not_in_place() -> None:
    stack = np.stack([*map(speckled, range(30)), *rooms(3), *walled_off(3)])
    before = stack.copy()
    repaired, cleared = repair(stack, radius=RADIUS, most=900)
    assert np.array_equal(stack, before)
    alone = [mended(cells) for cells in stack]
    assert np.array_equal(repaired, np.stack([cells for cells, _ in alone]))
    assert cleared.tolist() == [count for _, count in alone]
    assert repair(stack[:0], radius=RADIUS, most=1)[1].shape == (0,)


def test_a_wall_across_is_opened_by_four_cells_in_the_middle() -> None:
    cells = np.zeros((30, 30), dtype=np.bool_)
    cells[12] = True
    repaired, cleared = mended(cells)
    assert cleared == 4
    assert np.flatnonzero(~repaired[12]).tolist() == [13, 14, 15, 16]


def test_of_two_openings_the_wider_one_is_taken() -> None:
    cells = np.zeros((30, 30), dtype=np.bool_)
    cells[12] = True
    cells[12, 8:11] = False
    cells[12, 20:24] = False
    cells[12, 22] = True
    cells[12, 1:6] = False
    cells[12, 3] = True
    # One cell cleared leaves an opening of 4 cells near the middle, of 4, or of 5 at the side.
    repaired, cleared = mended(cells)
    assert cleared == 1
    assert not repaired[12, 3]


def test_start_and_goal_are_cleared_although_nothing_else_is_in_the_way() -> None:
    cells = np.zeros((30, 30), dtype=np.bool_)
    cells[[0, 29, 29, 5], [14, 14, 16, 3]] = True
    repaired, cleared = mended(cells)
    assert cleared == 3
    assert np.argwhere(repaired).tolist() == [[5, 3]]


def test_what_cannot_be_answered_for_is_refused() -> None:
    with pytest.raises(ValueError, match=r"\(2, 20, 30\)"):
        repair(np.zeros((2, 20, 30), dtype=np.bool_), radius=0.2, most=1)
    with pytest.raises(ValueError, match="inscribed radius"):
        repair(np.zeros((1, 30, 30), dtype=np.bool_), radius=0.5, most=1)
