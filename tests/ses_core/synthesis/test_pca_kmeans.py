import numpy as np
import pytest
from numpy.random import default_rng

from ses_core.arrays import BoolArray
from ses_core.synthesis.pca_kmeans import FittedPcaKmeans, PcaKmeans
from tests.ses_core.synthesis.places import domain_of, rooms


def fit(cells: BoolArray, *, components: int, clusters: int) -> FittedPcaKmeans:
    return PcaKmeans(components=components, clusters=clusters).fit(
        domain_of(cells), rng=default_rng(0), progress=lambda _: None
    )


def families(sizes: tuple[int, ...]) -> tuple[BoolArray, list[int]]:
    """Places in clearly separate families: a filled block each, with two cells flipped."""
    rng = default_rng(3)
    cells, labels = [], []
    for family, size in enumerate(sizes):
        for _ in range(size):
            place = np.zeros((30, 30), dtype=np.bool_)
            place[family * 6 : family * 6 + 5] = True
            place[tuple(rng.integers(0, 30, (2, 2)))] ^= True
            cells.append(place)
            labels.append(family)
    return np.stack(cells), labels


def family_of(place: BoolArray) -> int:
    return int(np.argmax([place[k * 6 : k * 6 + 5].sum() for k in range(5)]))


def test_first_round_takes_as_many_from_each_cluster() -> None:
    cells, _ = families((30, 20, 12, 9))
    fitted = fit(cells, components=60, clusters=4)
    drawn = fitted.sample(4 * 5, rng=default_rng(1))
    counts = np.bincount([family_of(place) for place in drawn], minlength=4)
    assert counts.tolist() == [5, 5, 5, 5]


def test_a_cluster_that_runs_out_is_passed_over() -> None:
    cells, _ = families((30, 2))
    fitted = fit(cells, components=20, clusters=2)
    counts = np.bincount([family_of(place) for place in fitted.sample(10, rng=default_rng(1))])
    assert counts.tolist() == [8, 2]


def test_clusters_find_the_families() -> None:
    cells, labels = families((30, 20, 12, 9))
    clusters = fit(cells, components=60, clusters=4).clusters
    assert len(set(zip(labels, clusters.tolist(), strict=True))) == 4


def test_all_components_reconstruct_every_environment_exactly() -> None:
    cells = rooms(25)
    drawn = fit(cells, components=24, clusters=5).sample(25, rng=default_rng(0))
    assert {place.tobytes() for place in drawn} == {place.tobytes() for place in cells}


def test_reconstruction_is_the_orthogonal_projection_binarised_at_one_half() -> None:
    cells = rooms(60, seed=7)
    fitted = fit(cells, components=8, clusters=60)
    flat = cells.reshape(60, 900).astype(np.float64)
    centred = flat - flat.mean(axis=0)
    # An independent way to the same subspace: eigenvectors of the scatter matrix.
    basis = np.linalg.eigh(centred.T @ centred)[1][:, -8:]
    projected = centred @ basis @ basis.T + flat.mean(axis=0)
    assert np.all(np.abs(projected - 0.5) > 1e-9)
    expected = {row.tobytes() for row in projected > 0.5}
    assert {place.tobytes() for place in fitted.sample(60, rng=default_rng(0))} == expected


@pytest.mark.parametrize("count", [2, 3])
def test_two_or_three_environments_are_enough(count: int) -> None:
    cells = rooms(count, seed=9)
    drawn = fit(cells, components=count - 1, clusters=20).sample(50, rng=default_rng(0))
    assert {place.tobytes() for place in drawn} == {place.tobytes() for place in cells}


@pytest.mark.filterwarnings("error")
def test_equal_environments_are_clustered_without_complaint() -> None:
    cells = np.repeat(rooms(2), 10, axis=0)
    assert len(fit(cells, components=3, clusters=6).sample(20, rng=default_rng(0))) == 20
