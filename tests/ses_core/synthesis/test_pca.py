import math
from typing import Literal

import numpy as np
import pytest
from numpy.random import default_rng

from ses_core.arrays import BoolArray
from ses_core.synthesis.fixed_order import FixedOrder
from ses_core.synthesis.pca import PcaKmeans
from ses_core.synthesis.principal_clusters import PrincipalClusters, find_clusters
from ses_core.synthesis_settings import PcaSettings
from tests.ses_core.synthesis.places import domain_of, families, family_of, rooms

Given = Literal["recorded", "reconstruction"]


def fit(
    cells: BoolArray,
    *,
    components: int,
    environments: int,
    per_cluster: int = 1,
    gives: Given = "recorded",
) -> FixedOrder:
    settings = PcaSettings(components=components, per_cluster=per_cluster, gives=gives)
    return PcaKmeans(settings, environments=environments).fit(
        domain_of(cells), rng=default_rng(0), progress=lambda _: None
    )


def keys(cells: BoolArray) -> list[bytes]:
    return [place.tobytes() for place in cells]


def away(found: PrincipalClusters, member: int) -> float:
    centre = found.centres[found.clusters[member]]
    return math.sqrt(sum((found.coordinates[member] - centre) ** 2))


@pytest.mark.parametrize("gives", ["recorded", "reconstruction"])
@pytest.mark.parametrize("per_cluster", [1, 3])
def test_what_stands_for_a_cluster_is_nearest_to_its_centre(gives: Given, per_cluster: int) -> None:
    cells = np.unique(rooms(80, seed=5), axis=0)
    found = find_clusters(
        cells, components=20, clusters=6, rng=default_rng(0), progress=lambda _: None
    )
    given = cells if gives == "recorded" else found.reconstructions(threshold=0.5)
    piles: dict[int, list[bytes]] = {number: [] for number in range(6)}
    seen: set[bytes] = set()
    # Distances differ by far more than they are rounded, but for the members of pairs.
    for member in sorted(range(len(cells)), key=lambda one: (round(away(found, one), 9), one)):
        if given[member].tobytes() not in seen:
            seen.add(given[member].tobytes())
            piles[int(found.clusters[member])].append(given[member].tobytes())
    by_size = sorted(range(6), key=lambda number: (-(found.clusters == number).sum(), number))
    expected = [
        piles[number][turn]
        for turn in range(len(cells))
        for number in by_size
        if turn < len(piles[number])
    ]
    fitted = fit(
        cells, components=20, environments=6 * per_cluster, per_cluster=per_cluster, gives=gives
    )
    assert keys(fitted.sample(400, rng=default_rng(9))) == expected


def test_recorded_environments_are_given_as_they_are() -> None:
    cells = rooms(50, seed=2)
    drawn = fit(cells, components=3, environments=10).sample(10, rng=default_rng(0))
    assert set(keys(drawn)) < set(keys(cells))
    few = fit(cells, components=3, environments=10, gives="reconstruction")
    assert not set(keys(few.sample(10, rng=default_rng(0)))) < set(keys(cells))


def test_the_largest_cluster_comes_first_and_the_others_by_size() -> None:
    cells, _ = families((9, 30, 12, 20))
    drawn = fit(cells, components=60, environments=4).sample(8, rng=default_rng(0))
    assert [family_of(place) for place in drawn] == [1, 3, 2, 0] * 2


@pytest.mark.parametrize("gives", ["recorded", "reconstruction"])
def test_equal_ones_come_once_and_count_as_often_as_they_are_recorded(gives: Given) -> None:
    cells, _ = families((6, 5, 4))
    often = np.concatenate((cells, np.repeat(cells[-4:-3], 12, axis=0)))
    drawn = fit(often, components=26, environments=3, gives=gives).sample(99, rng=default_rng(0))
    assert sorted(keys(drawn)) == sorted(set(keys(cells)))
    # The last family has the fewest different members and, with its copies, the most.
    assert family_of(drawn[0]) == 2


def test_of_two_equally_near_to_the_centre_the_harder_one_comes_first() -> None:
    pairs, labels = families((2, 2, 2, 2, 2))
    for order in (np.arange(10), np.arange(10)[::-1]):
        cells = pairs[order]
        drawn = fit(cells, components=9, environments=5).sample(5, rng=default_rng(0))
        families_in_order = [labels[member] for member in order]
        first = {family: keys(cells)[families_in_order.index(family)] for family in range(5)}
        assert {family_of(place): place.tobytes() for place in drawn} == first


@pytest.mark.filterwarnings("error")
def test_fewer_different_environments_than_clusters_are_no_trouble() -> None:
    cells = np.repeat(rooms(3), 10, axis=0)
    drawn = fit(cells, components=2, environments=20).sample(400, rng=default_rng(0))
    assert sorted(keys(drawn)) == sorted(set(keys(cells)))
