import numpy as np
import pytest

from ses_core.arrays import BoolArray
from ses_core.scorecard.copies import chance_nearer, memorisation, near_duplicate_share
from ses_core.scorecard.copy_rows import copy_rows
from ses_core.scorecard.distances import differing_cells, distinct_maps, mirrored
from ses_core.scorecard.rows import ScorecardRow
from ses_core.scorecard.sampled import Sampled
from tests.ses_core.scorecard.samples import QUICK, all_of, pillars, sites

# With fewer blocks two places are no more cells apart than a copy may be.
REAL = pillars(60, seed=0, least=4)
GROUPS = sites(*(6,) * 10)


def copies_row(
    metric: str,
    made: BoolArray,
    *,
    mirrored_too: bool = False,
    training: BoolArray | None = None,
) -> ScorecardRow:
    """Give a row about copies of `REAL`, or of `training` with `REAL` held out."""
    rows = copy_rows(
        REAL,
        made,
        GROUPS,
        Sampled(maps=distinct_maps(np.concatenate((REAL, made))), grouping=GROUPS, splits=[]),
        settings=QUICK,
        rng=np.random.default_rng(0),
        training=training,
    )
    return [row for row in rows if row.metric == metric][mirrored_too]


def slightly_changed(cells: BoolArray) -> BoolArray:
    """Flip five cells of each."""
    rng = np.random.default_rng(5)
    changed = cells.copy()
    for one in changed:
        one.ravel()[rng.choice(900, 5, replace=False)] ^= True
    return changed


@pytest.mark.parametrize("made", [REAL[:40], slightly_changed(REAL[:40])])
def test_copies_are_flagged_as_memorised(made: BoolArray) -> None:
    copies, memorised = copies_row("copies", made), copies_row("memorisation", made)
    assert copies.value == 1.0
    assert (copies.real_value or 0.0) < 0.1
    assert (memorised.value or 0.0) > 0.9
    assert (memorised.p_value or 1.0) < 1e-6


def test_mirrored_copies_are_flagged_only_where_mirror_images_count() -> None:
    made = mirrored(REAL[:40])
    assert (copies_row("copies", made).value or 0.0) < 0.2
    assert copies_row("copies", made, mirrored_too=True).value == 1.0
    assert (copies_row("memorisation", made, mirrored_too=True).p_value or 1.0) < 1e-6


def test_beside_held_out_places_copies_are_looked_for_among_what_was_learned_from() -> None:
    training = pillars(50, seed=7, least=4)
    of_training = copies_row("copies", slightly_changed(training[:40]), training=training)
    assert (of_training.value, of_training.n_real) == (1.0, len(REAL))
    assert (of_training.real_value or 0.0) < 0.1
    of_heldout = copies_row("copies", slightly_changed(REAL[:40]), training=training)
    assert (of_heldout.value or 0.0) < 0.1
    memorised = copies_row("memorisation", training[:40], training=training)
    assert (memorised.value or 0.0) > 0.9
    fresh = copies_row("memorisation", pillars(40, seed=9, least=4), training=training)
    assert 0.3 < (fresh.value or 0.0) < 0.7


@pytest.mark.parametrize("mirrored_too", [False, True])
def test_new_places_of_the_same_kind_are_not_flagged(mirrored_too: bool) -> None:
    made = pillars(40, seed=9, least=4)
    one = copies_row("memorisation", made, mirrored_too=mirrored_too)
    assert 0.3 < (one.value or 0.0) < 0.7
    assert (one.p_value or 0.0) > 0.01
    assert (one.low or 1.0) < 0.5 < (one.high or 0.0)


def test_two_groups_do_not_make_new_places_look_memorised() -> None:
    # A real place has half of the others to be near to; a synthesized one must have no more.
    rng = np.random.default_rng(0)
    nearer = [
        memorisation(
            pillars(60, seed=100 + seed, least=4),
            pillars(60, seed=200 + seed, least=4),
            sites(30, 30),
            mirrored_too=False,
            rng=rng,
        ).nearer
        for seed in range(12)
    ]
    assert 0.46 < np.mean(nearer) < 0.54


def test_the_chance_to_be_nearer_counts_ties_half() -> None:
    rng = np.random.default_rng(0)
    first, second = rng.integers(0, 5, 12).astype(float), rng.integers(0, 5, 9).astype(float)
    pairs = [(a < b) + 0.5 * (a == b) for a in first for b in second]
    assert np.isclose(chance_nearer(first, second), np.mean(pairs))


def test_near_duplicates_are_those_with_another_within_reach() -> None:
    places = np.concatenate((REAL[:3], slightly_changed(REAL[:1])))
    apart = differing_cells(places, places)
    assert near_duplicate_share(apart, all_of(4), cells=5) == 0.5
    assert near_duplicate_share(apart, all_of(4), cells=4) == 0.0
    assert near_duplicate_share(apart, np.array([0, 1, 1]), cells=0) == 2 / 3
