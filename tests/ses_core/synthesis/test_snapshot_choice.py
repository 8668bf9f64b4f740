import numpy as np
import pytest
from numpy.random import default_rng

from ses_core.arrays import BoolArray
from ses_core.navigation import NavigationDomain
from ses_core.synthesis.generator_network import DenseLayer, GeneratorNetwork
from ses_core.synthesis.snapshot_choice import SnapshotChoice, coverage, held_out
from ses_core.synthesis_settings import GanSettings
from tests.ses_core.synthesis.places import domain_of, rooms


def settings(**updates: object) -> GanSettings:
    return GanSettings().model_copy(update=updates)


def network_of(cells: BoolArray) -> GeneratorNetwork:
    """Make a generator that draws one of 8 places, by the signs of 3 numbers."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return GeneratorNetwork(
        layers=(
            DenseLayer(
                weight=(8.0 * corners.T).astype(np.float32), bias=np.zeros(8, dtype=np.float32)
            ),
            DenseLayer(
                weight=np.where(cells, 1.0, -1.0).reshape(8, 900).astype(np.float32),
                bias=np.zeros(900, dtype=np.float32),
            ),
        ),
        leaky_slope=1e-9,
    )


@pytest.mark.parametrize(
    ("count", "expected"), [(0, 0), (1, 0), (299, 0), (300, 30), (3769, 376), (9000, 500)]
)
def test_so_many_are_held_out(count: int, expected: int) -> None:
    domain = domain_of(np.resize(rooms(200), (count, 30, 30)))
    taught, kept_back = held_out(domain, settings=GanSettings())
    assert len(kept_back) == expected
    assert np.array_equal(np.sort(np.concatenate((taught, kept_back))), np.arange(count))


def test_the_next_night_holds_out_the_same_environments() -> None:
    """Its window has moved on by a few: what it teaches was not held out the night before."""
    environments = domain_of(rooms(440)).environments
    nights = []
    for domain in (NavigationDomain(environments[:400]), NavigationDomain(environments[40:])):
        _, kept_back = held_out(domain, settings=GanSettings())
        nights.append({domain.environments[number].environment_id for number in kept_back})
    assert len(nights[0] & nights[1]) >= 30
    assert nights[0] != {f"e{number}" for number in range(40)}


def test_none_is_held_out_where_too_few_differ() -> None:
    _, kept_back = held_out(domain_of(np.resize(rooms(5), (400, 30, 30))), settings=GanSettings())
    assert len(kept_back) == 0


def test_copies_cover_everything_and_one_place_covers_little() -> None:
    heldout = rooms(60)
    assert coverage(heldout, heldout, k=5) == 1.0
    assert coverage(heldout, np.repeat(heldout[:1], 60, axis=0), k=5) < 0.5


def test_too_few_different_places_are_not_covered() -> None:
    assert coverage(np.repeat(rooms(5), 10, axis=0), rooms(5), k=5) == 0.0


def test_the_one_that_covers_best_is_kept_and_then_enough_is_enough() -> None:
    heldout = rooms(200)
    poor, good = network_of(np.repeat(heldout[:1], 8, axis=0)), network_of(heldout[:8])
    choice = SnapshotChoice(heldout, settings=settings(patience=2), rng=default_rng(0))
    for network, is_over in ((poor, False), (good, False), (poor, False), (poor, True)):
        choice.consider(network)
        assert choice.is_over == is_over
    assert choice.best is good


def test_of_equals_the_later_is_kept() -> None:
    heldout = rooms(40)
    far = np.zeros((8, 30, 30), dtype=np.bool_)
    far[:, ::2] = True
    choice = SnapshotChoice(heldout, settings=settings(patience=1), rng=default_rng(0))
    networks = [network_of(far) for _ in range(4)]
    for network in networks:
        choice.consider(network)
        assert choice.best is network
        assert not choice.is_over


def test_without_anything_held_out_the_last_is_kept() -> None:
    choice = SnapshotChoice(rooms(0), settings=settings(patience=1), rng=default_rng(0))
    networks = [network_of(rooms(8, seed=seed)) for seed in range(3)]
    for network in networks:
        choice.consider(network)
        assert choice.best is network
        assert not choice.is_over


def test_nothing_shown_is_said() -> None:
    choice = SnapshotChoice(rooms(0), settings=GanSettings(), rng=default_rng(0))
    with pytest.raises(ValueError, match="expected at least one"):
        _ = choice.best
