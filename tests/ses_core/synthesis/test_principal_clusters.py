import numpy as np
import pytest
from numpy.random import default_rng

from ses_core.synthesis.principal_clusters import PrincipalClusters, find_clusters
from tests.ses_core.synthesis.places import families, rooms

CELLS = rooms(70, seed=3)


def find(components: int, clusters: int) -> PrincipalClusters:
    return find_clusters(
        CELLS,
        components=components,
        clusters=clusters,
        rng=default_rng(0),
        progress=lambda _: None,
    )


@pytest.mark.parametrize("components", [1, 7, 40])
def test_coordinates_are_those_of_a_singular_value_decomposition(components: int) -> None:
    flat = CELLS.reshape(len(CELLS), 900).astype(np.float64)
    left, values, right = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)
    # Singular values that differ make each component the only one, but for its sign.
    assert np.diff(values[: components + 1]).max() < -1e-9
    found = find(components, clusters=5)
    expected = left[:, :components] * values[:components]
    signs = np.sign((found.coordinates * expected).sum(axis=0))
    assert np.allclose(found.coordinates, expected * signs, atol=1e-9)
    assert np.allclose(found.components, right[:components] * signs[:, None], atol=1e-9)
    assert np.allclose(found.mean, flat.mean(axis=0))


def test_every_environment_is_in_the_cluster_whose_centre_is_nearest() -> None:
    found = find(30, clusters=9)
    for number, place in enumerate(found.coordinates):
        away = [float(np.sqrt(((place - centre) ** 2).sum())) for centre in found.centres]
        assert found.clusters[number] == int(np.argmin(away))
        assert found.distances()[number] == pytest.approx(min(away))
    for number, centre in enumerate(found.centres):
        members = found.coordinates[found.clusters == number]
        assert len(members) == found.sizes()[number]
        assert np.allclose(members.mean(axis=0), centre)


def test_clusters_find_the_families() -> None:
    cells, labels = families((30, 20, 12, 9))
    found = find_clusters(
        cells, components=60, clusters=4, rng=default_rng(0), progress=lambda _: None
    )
    assert len(set(zip(labels, found.clusters.tolist(), strict=True))) == 4
