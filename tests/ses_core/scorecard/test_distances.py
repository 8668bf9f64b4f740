import numpy as np
from scipy.spatial.distance import cdist

from ses_core.scorecard.distances import (
    clearance_feature,
    differing_cells,
    differing_cells_or_mirrored,
    distinct_maps,
    euclidean,
    mirrored,
    nearest,
)
from tests.ses_core.scorecard.samples import pillars


def test_differing_cells_are_scipys_hamming_distance() -> None:
    first, second = pillars(7, seed=0), pillars(9, seed=1)
    expected = 900 * cdist(first.reshape(7, -1), second.reshape(9, -1), "hamming")
    assert np.array_equal(differing_cells(first, second), np.rint(expected))


def test_a_mirror_image_is_at_no_distance_and_no_turned_one() -> None:
    places = pillars(5, seed=0)
    assert not np.diag(differing_cells_or_mirrored(places, mirrored(places))).any()
    upside_down = np.ascontiguousarray(places[:, ::-1])
    assert np.diag(differing_cells_or_mirrored(places, upside_down)).all()


def test_distinct_maps_give_back_every_environment() -> None:
    places = pillars(6, seed=0)
    many = np.concatenate((places, places[[3, 3, 0]], pillars(2, seed=1)))
    found = distinct_maps(many)
    assert len(found.cells) == 8
    assert np.array_equal(found.cells[found.index], many)
    assert found.index.tolist()[:9] == [0, 1, 2, 3, 4, 5, 3, 3, 0]


def test_euclidean_distances_are_scipys_symmetric_and_zero_to_oneself() -> None:
    features = clearance_feature(pillars(20, seed=0))
    found = euclidean(features)
    assert np.allclose(found, cdist(features, features), atol=1e-5)
    assert np.array_equal(found, found.T)
    assert not np.diag(found).any()


def test_clearance_is_capped_in_an_empty_place_and_nothing_in_a_full_one() -> None:
    empty, full = np.zeros((1, 30, 30), np.bool_), np.ones((1, 30, 30), np.bool_)
    assert set(clearance_feature(empty).ravel().tolist()) == {1.0}
    assert set(clearance_feature(full).ravel().tolist()) == {0.0}
    assert clearance_feature(empty[:0]).shape == (0, 900)


def test_the_nearest_leaves_a_group_out() -> None:
    among = pillars(4, seed=0)
    groups = np.array([0, 0, 1, 1])
    found = nearest(
        among[:1],
        among,
        left_out=np.array([0]),
        groups=groups,
        mirrored_too=False,
    )
    assert found[0] == differing_cells(among[:1], among[2:]).min()
    nothing = nearest(
        among[:1],
        among[:2],
        left_out=np.array([0]),
        groups=groups[:2],
        mirrored_too=False,
    )
    assert np.isinf(nothing[0])
