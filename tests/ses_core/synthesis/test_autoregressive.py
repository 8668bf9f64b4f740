"""The network against brute force: every chance is that of a cell given those before it."""

import itertools

import numpy as np
import pytest
import torch
from numpy.random import default_rng

from ses_core.arrays import BoolArray, FloatArray
from ses_core.robot_profile import JACKAL
from ses_core.synthesis.autoregressive import Autoregressive, CausalNetwork, Examples
from ses_core.synthesis.autoregressive_network import AutoregressiveNetwork
from ses_core.synthesis.traversability import traversable
from ses_core.synthesis_settings import AutoregressiveSettings
from tests.ses_core.synthesis.places import domain_of, rooms

SMALL = AutoregressiveSettings(reach=4, hidden=24, updates=5)


def random_network(*, keeps_way_open: bool = False) -> AutoregressiveNetwork:
    """Make a network whose chances depend on everything they may depend on."""
    rng, reach, hidden = default_rng(4), 4, 24
    inputs = reach * (2 * reach + 1) + reach

    def normal(*shape: int, scale: float) -> np.ndarray:
        return rng.normal(0.0, scale, shape).astype(np.float32)

    return AutoregressiveNetwork(
        window_weight=normal(inputs, hidden, scale=0.3),
        by_row=normal(30, hidden, scale=0.3),
        by_column=normal(30, hidden, scale=0.3),
        hidden_weight=normal(hidden, hidden, scale=0.3),
        hidden_bias=normal(hidden, scale=0.2),
        output_weight=normal(hidden, scale=0.3),
        output_by_row=normal(30, scale=0.3),
        output_by_column=normal(30, scale=0.3),
        reach=reach,
        temperature=1.0,
        keeps_way_open=keeps_way_open,
    )


def chances(network: AutoregressiveNetwork, cells: BoolArray) -> FloatArray:
    """Compute the chance of each cell (30, 30) given those before it, cell by cell."""
    reach, signs = network.reach, np.where(cells[::-1], 1.0, -1.0)
    found = np.zeros((30, 30))
    for row, column in itertools.product(range(30), range(30)):
        seen = []
        for r, c in [
            *itertools.product(range(row - reach, row), range(column - reach, column + reach + 1)),
            *((row, c) for c in range(column - reach, column)),
        ]:
            seen.append(signs[r, c] if r >= 0 and 0 <= c < 30 else 0.0)
        place = network.by_row[row] + network.by_column[column]
        first = np.maximum(np.array(seen) @ network.window_weight + place, 0.0)
        second = np.maximum(first @ network.hidden_weight + network.hidden_bias, 0.0)
        logit = (first + second) @ network.output_weight
        logit += network.output_by_row[row] + network.output_by_column[column]
        found[29 - row, column] = 1.0 / (1.0 + np.exp(-logit / network.temperature))
    return found


def test_cells_are_drawn_by_their_chance_given_those_before_them() -> None:
    """A cell is occupied if and only if its chance is above the uniform number drawn for it."""
    network = random_network()
    drawn = network.sample(3, rng=default_rng(7))
    uniform = default_rng(7).random((3, 30, 30), dtype=np.float32)[:, ::-1]
    for cells, numbers in zip(drawn, uniform, strict=True):
        clear = np.abs(chances(network, cells) - numbers) > 1e-5
        assert clear.mean() > 0.99
        assert np.array_equal(cells[clear], (chances(network, cells) > numbers)[clear])
    assert 0.1 < drawn.mean() < 0.9


def test_torch_trains_the_network_that_numpy_draws_from() -> None:
    network = random_network()
    trained = CausalNetwork(AutoregressiveSettings(reach=4, hidden=24))
    trained.begin_with(network)
    trained.eval()
    cells = rooms(2, seed=1)
    examples = Examples.of(cells, reach=4)
    flat = examples.windows[0].reshape(900, -1)[:, : network.window_weight.shape[0]]
    with torch.no_grad():
        rows, columns = torch.arange(900) // 30, torch.arange(900) % 30
        logits = trained(torch.from_numpy(flat.astype(np.float32)), rows, columns).numpy()
    expected = chances(network, cells[0])[::-1].ravel()
    assert np.abs(1.0 / (1.0 + np.exp(-logits)) - expected).max() < 1e-5


def test_weights_make_up_for_how_examples_are_drawn() -> None:
    """The weighted share of occupied cells is that among all cells, mirror images included."""
    cells = rooms(60)
    examples, rng = Examples.of(cells, reach=3), default_rng(0)
    targets, weights = [], []
    for _ in range(200):
        *_, occupied, weight = examples.draw(1024, 0.25, rng)
        targets.append(occupied.numpy())
        weights.append(weight.numpy())
    share = np.average(np.concatenate(targets), weights=np.concatenate(weights))
    assert share == pytest.approx(cells.mean(), rel=0.03)
    assert np.mean(np.concatenate(targets)) > 1.5 * cells.mean()


def test_the_fit_learns_what_the_places_have_in_common() -> None:
    """Rooms have a wall across, two cells thick, with one doorway five cells wide."""
    settings = AutoregressiveSettings(reach=6, hidden=64, updates=700, batch_size=512, dropout=0.0)
    fitted = Autoregressive(settings).fit(
        domain_of(rooms(200)), rng=default_rng(0), progress=lambda _: None
    )
    drawn = fitted.sample(200, rng=default_rng(1))
    walls = drawn.sum(axis=2) >= 20
    # A window of six rows and columns does not see whether there was a wall or a doorway before.
    assert 0.7 < walls.sum(axis=1).mean() / 2 < 1.5
    assert np.mean(walls.sum(axis=1) % 2 == 0) > 0.8
    assert np.mean(drawn[~walls]) < 0.01
    assert np.mean(drawn[walls].sum(axis=1) % 5 == 0) > 0.8
    assert len({place.tobytes() for place in drawn}) > 100


def test_a_way_stays_open_for_the_disc_that_is_asked_for() -> None:
    network = random_network(keeps_way_open=True)
    free = network.sample(20, rng=default_rng(0))
    assert not traversable(free, radius=JACKAL.inscribed_radius_m).all()
    radius = JACKAL.inscribed_radius_m
    kept = network.sample(20, rng=default_rng(0), radius=radius)
    assert traversable(kept, radius=radius).all()


def test_a_low_temperature_draws_the_likeliest() -> None:
    network = random_network()
    cold = AutoregressiveNetwork(
        **{name: getattr(network, name) for name in network.arrays() if name != "temperature"},
        temperature=1e-6,
    )
    drawn = cold.sample(3, rng=default_rng(0))
    for place in drawn:
        assert np.array_equal(place, chances(network, place) > 0.5)


def test_a_warm_start_begins_with_the_earlier_weights() -> None:
    domain = domain_of(rooms(30))
    few = AutoregressiveSettings(reach=4, hidden=24, updates=1, learning_rate=1e-12)

    def fit(start: AutoregressiveNetwork | None) -> AutoregressiveNetwork:
        return Autoregressive(few).fit(
            domain, rng=default_rng(0), progress=lambda _: None, start=start
        )

    network = random_network()
    assert np.allclose(fit(network).window_weight, network.window_weight, atol=1e-6)
    assert not np.allclose(fit(None).window_weight, network.window_weight, atol=0.1)


@pytest.mark.parametrize(("plain_share", "cells"), [(0.99, rooms(4)), (0.01, rooms(4))])
def test_a_batch_holds_some_of_each_kind(plain_share: float, cells: BoolArray) -> None:
    *_, weights = Examples.of(cells, reach=3).draw(32, plain_share, default_rng(0))
    assert len(set(weights.tolist())) == 2


@pytest.mark.parametrize("is_full", [False, True])
def test_places_that_are_all_alike_can_be_learned(is_full: bool) -> None:
    cells = np.full((3, 30, 30), is_full)
    *_, occupied, weights = Examples.of(cells, reach=3).draw(64, 0.25, default_rng(0))
    assert np.average(occupied.numpy(), weights=weights.numpy()) == is_full
    assert weights.sum() == pytest.approx(64)
