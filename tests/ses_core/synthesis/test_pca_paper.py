import numpy as np
import pytest
from numpy.random import default_rng

from ses_core.arrays import BoolArray
from ses_core.synthesis.pca_paper import PcaPaper
from ses_core.synthesis.pca_selection import ClusterDraw
from ses_core.synthesis_settings import PcaPaperSettings
from tests.ses_core.synthesis.places import domain_of, families, family_of, rooms


def fit(
    cells: BoolArray,
    *,
    components: int,
    environments: int = 100,
    per_cluster: int = 5,
    threshold: float = 0.5,
) -> ClusterDraw:
    settings = PcaPaperSettings(components=components, per_cluster=per_cluster, threshold=threshold)
    return PcaPaper(settings, environments=environments).fit(
        domain_of(cells), rng=default_rng(0), progress=lambda _: None
    )


def test_defaults_are_the_papers_where_it_has_numbers() -> None:
    settings = PcaPaperSettings()
    assert settings.components == 100
    assert 100 % settings.per_cluster == 0


@pytest.mark.parametrize(
    ("environments", "per_cluster", "clusters"), [(20, 5, 4), (21, 5, 5), (3, 5, 1), (7, 1, 7)]
)
def test_clusters_are_as_many_as_make_up_what_is_asked_for(
    environments: int, per_cluster: int, clusters: int
) -> None:
    fitted = fit(rooms(60), components=20, environments=environments, per_cluster=per_cluster)
    assert len(np.unique(fitted.clusters)) == clusters


def test_as_many_are_drawn_from_each_cluster_and_by_chance() -> None:
    cells, labels = families((30, 20, 12, 9))
    fitted = fit(cells, components=60, environments=20)
    draws = [fitted.sample(20, rng=default_rng(seed)) for seed in range(200)]
    counts = np.array([[family_of(place) for place in drawn] for drawn in draws])
    assert all(np.bincount(row, minlength=4).tolist() == [5, 5, 5, 5] for row in counts)
    # Every member of the largest family is drawn at times: 5 of 30, 200 times, each 33 +- 5.
    hits = dict.fromkeys((place.tobytes() for place in fitted.cells[:30]), 0)
    for drawn in draws:
        for place in drawn:
            if place.tobytes() in hits:
                hits[place.tobytes()] += 1
    assert labels[29] == 0
    assert len(hits) == 30
    assert min(hits.values()) > 10


def test_a_cluster_that_runs_out_is_passed_over() -> None:
    cells, _ = families((30, 2))
    fitted = fit(cells, components=20, environments=10)
    counts = np.bincount([family_of(place) for place in fitted.sample(10, rng=default_rng(1))])
    assert counts.tolist() == [8, 2]


def test_none_is_drawn_twice_and_none_is_left_out() -> None:
    cells = rooms(25)
    fitted = fit(cells, components=24, environments=25)
    drawn = fitted.sample(500, rng=default_rng(0))
    assert sorted(place.tobytes() for place in drawn) == sorted(place.tobytes() for place in cells)


@pytest.mark.parametrize("threshold", [0.3, 0.5, 0.7])
def test_reconstruction_is_the_orthogonal_projection_binarised(threshold: float) -> None:
    cells = rooms(60, seed=7)
    fitted = fit(cells, components=8, environments=60, threshold=threshold)
    flat = cells.reshape(60, 900).astype(np.float64)
    centred = flat - flat.mean(axis=0)
    # An independent way to the same subspace: eigenvectors of the scatter matrix.
    basis = np.linalg.eigh(centred.T @ centred)[1][:, -8:]
    projected = centred @ basis @ basis.T + flat.mean(axis=0)
    assert np.all(np.abs(projected - threshold) > 1e-9)
    expected = {row.tobytes() for row in projected > threshold}
    assert {place.tobytes() for place in fitted.sample(60, rng=default_rng(0))} == expected


@pytest.mark.parametrize("count", [2, 3])
def test_two_or_three_environments_are_enough(count: int) -> None:
    cells = rooms(count, seed=9)
    drawn = fit(cells, components=count - 1).sample(50, rng=default_rng(0))
    assert {place.tobytes() for place in drawn} == {place.tobytes() for place in cells}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("different", [1, 2])
def test_equal_environments_are_clustered_without_complaint(different: int) -> None:
    cells = np.repeat(rooms(different), 20 // different, axis=0)
    drawn = fit(cells, components=3, environments=30).sample(20, rng=default_rng(0))
    assert len(drawn) == 20
    assert {place.tobytes() for place in drawn} == {place.tobytes() for place in cells}
