import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.neighbors import NearestNeighbors

from ses_core.arrays import IntArray
from ses_core.scorecard.distances import differing_cells
from ses_core.scorecard.manifolds import manifold_scores
from tests.ses_core.scorecard.samples import all_of, pillars


def test_equal_samples_cover_each_other_wholly() -> None:
    places = pillars(30, seed=0)
    found = manifold_scores(differing_cells(places, places), all_of(30), all_of(30), k=3)
    assert found is not None
    assert (found.precision, found.recall, found.coverage) == (1.0, 1.0, 1.0)


def test_samples_far_apart_cover_nothing() -> None:
    few, full = pillars(20, seed=0), ~pillars(20, seed=1)
    both = np.concatenate((few, full))
    found = manifold_scores(differing_cells(both, both), all_of(20), all_of(20, 20), k=3)
    assert found is not None
    assert (found.precision, found.recall, found.density, found.coverage) == (0.0, 0.0, 0.0, 0.0)


def test_a_generator_of_one_map_has_precision_and_poor_coverage() -> None:
    places = pillars(30, seed=0)
    apart = differing_cells(places, places)
    found = manifold_scores(apart, all_of(30), np.full(30, 4), k=3)
    assert found is not None
    assert found.precision == 1.0
    assert found.recall == 1 / 30
    assert found.coverage < 0.7


def test_copies_among_the_real_do_not_shrink_their_balls() -> None:
    places = pillars(30, seed=0)
    apart = differing_cells(places, places)
    once = manifold_scores(apart, all_of(20), all_of(10, 20), k=3)
    often = manifold_scores(apart, np.repeat(all_of(20), 5), all_of(10, 20), k=3)
    assert once == often


def test_too_few_different_real_maps_give_nothing() -> None:
    places = pillars(4, seed=0)
    apart = differing_cells(places, places)
    assert manifold_scores(apart, np.repeat(all_of(3), 4), all_of(4), k=3) is None
    assert manifold_scores(apart, all_of(4), all_of(0), k=3) is None
    assert manifold_scores(apart, all_of(4), all_of(4), k=3) is not None


@settings(max_examples=25, deadline=None)
@given(st.data())
def test_brute_force_and_sklearn_agree(data: st.DataObject) -> None:
    # Points on a small whole-number line: full of ties and copies, as binary maps are.
    line = np.arange(25, dtype=np.float32)
    apart = np.abs(line[:, None] - line[None, :])
    some = st.lists(st.integers(0, 24), min_size=6, max_size=20)
    real, made = np.array(data.draw(some)), np.array(data.draw(some))
    k = 2
    if min(len(set(real)), len(set(made))) <= k:
        return
    found = manifold_scores(apart, real, made, k=k)
    assert found is not None
    radius_of = {point: _kth(real, point, k) for point in set(real.tolist())}
    own_radius_of = {point: _kth(made, point, k) for point in set(made.tolist())}
    is_in = [[abs(s - r) <= radius_of[r] for r in real.tolist()] for s in made.tolist()]
    balls = [sum(abs(s - r) <= radius for r, radius in radius_of.items()) for s in made.tolist()]
    assert found.precision == np.mean([any(line) for line in is_in])
    assert found.coverage == np.mean([any(column) for column in zip(*is_in, strict=True)])
    assert np.isclose(found.density, np.mean(balls) / k)
    assert found.recall == np.mean(
        [any(abs(s - r) <= radius for s, radius in own_radius_of.items()) for r in real.tolist()]
    )


def _kth(sample: IntArray, point: int, k: int) -> float:
    different = np.unique(sample).reshape(-1, 1)
    neighbours = NearestNeighbors(n_neighbors=k + 1).fit(different)
    return float(neighbours.kneighbors([[point]])[0][0, k])
