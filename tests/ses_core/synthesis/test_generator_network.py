from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch
from numpy.random import default_rng
from scipy import ndimage
from torch import nn

from ses_core.synthesis import gan_networks, gan_paper
from ses_core.synthesis.generator_modules import Bands, as_network, keep_free, load_network
from ses_core.synthesis.generator_network import (
    SAMPLES_AT_ONCE,
    GeneratorNetwork,
    network_from_arrays,
    without_specks,
)
from ses_core.synthesis.seeded_torch import one_seeded_thread
from ses_core.synthesis_settings import GanPaperSettings, GanSettings

SLOPE = 0.2

BUILDERS: dict[str, Callable[[], nn.Sequential]] = {
    "gan-paper": lambda: gan_paper.build_generator(GanPaperSettings(latent_size=16)),
    "gan": lambda: gan_networks.build_generator(GanSettings(latent_size=16)),
}

either = pytest.mark.parametrize("method", BUILDERS)


def used_generator(method: str) -> nn.Sequential:
    """Build a generator whose running statistics and weights are those of no beginning."""
    with one_seeded_thread(0):
        generator = BUILDERS[method]()
        for weight in generator.parameters():
            weight.data += 0.1 * torch.randn(weight.shape)
        for _ in range(20):
            generator(0.5 + 2.0 * torch.randn(64, 16))
    return generator


def evaluated(generator: nn.Sequential, noise: np.ndarray) -> np.ndarray:
    generator.eval()
    with torch.no_grad():
        values: np.ndarray = generator(torch.from_numpy(noise)).numpy()
    return values


def noise(count: int) -> np.ndarray:
    return default_rng(1).standard_normal((count, 16), dtype=np.float32)


@either
def test_numpy_network_equals_the_torch_generator_with_running_statistics(method: str) -> None:
    generator = used_generator(method)
    found = as_network(generator, leaky_slope=SLOPE).values(noise(50))
    expected = evaluated(generator, noise(50))
    if method == "gan-paper":
        found = np.tanh(found)
    assert np.abs(found - expected).max() < 1e-4 * max(np.abs(expected).max(), 1.0)


@either
def test_samples_do_not_depend_on_how_many_are_computed_at_once(method: str) -> None:
    network = as_network(used_generator(method), leaky_slope=SLOPE)
    count = SAMPLES_AT_ONCE + 5
    cells = network.sample(count, rng=default_rng(1))
    values = network.values(noise(count)).reshape(count, 30, 30)
    clear = np.abs(values) > 1e-3
    assert np.array_equal(cells[clear], (values > 0)[clear])


@either
def test_arrays_rebuild_the_network(method: str) -> None:
    network = as_network(used_generator(method), leaky_slope=SLOPE)
    rebuilt = network_from_arrays(network.arrays())
    assert np.array_equal(rebuilt.values(noise(9)), network.values(noise(9)))


@either
def test_a_loaded_generator_goes_on_from_what_it_drew(method: str) -> None:
    """As it trains (statistics of the batch) and as it evaluates (running statistics)."""
    network = as_network(used_generator(method), leaky_slope=SLOPE)
    with one_seeded_thread(5):
        generator = BUILDERS[method]()
        load_network(generator, network)
        draws = noise(4000)
        generator.train()
        with torch.no_grad():
            training: np.ndarray = generator(torch.from_numpy(draws)).numpy()
    expected = network.values(draws)
    for found in (training, evaluated(generator, draws)):
        assert ((found > 0) == (expected > 0)).mean() > 0.98


def test_layers_of_other_shapes_stay_as_they_were() -> None:
    settings = GanSettings(latent_size=16)
    network = as_network(used_generator("gan"), leaky_slope=SLOPE)
    with one_seeded_thread(5):
        wider = gan_networks.build_generator(settings.model_copy(update={"latent_size": 17}))
        before = [weight.detach().clone() for weight in wider.parameters()]
        load_network(wider, network)
    after = [weight.detach() for weight in wider.parameters()]
    is_equal = [torch.equal(first, second) for first, second in zip(before, after, strict=True)]
    # The first layer's weight, bias and normalization stay, all others are loaded.
    assert is_equal == [True] * 4 + [False] * (len(before) - 4)
    last = after[-2].numpy()
    assert np.array_equal(last, network.layers[-1].weight)


def test_a_missing_layer_is_missed() -> None:
    with pytest.raises(KeyError):
        network_from_arrays({"leaky_slope": np.array(0.2)})


def test_a_bias_moves_its_own_cell_alone() -> None:
    """Rows, columns and order are not mixed up on the way out of torch."""
    network = as_network(used_generator("gan"), leaky_slope=SLOPE)
    last = network.layers[-1]
    bias = last.bias.copy()
    bias[3, 20] += 1000.0
    moved = GeneratorNetwork(
        layers=(*network.layers[:-1], type(last)(weight=last.weight, bias=bias)), leaky_slope=SLOPE
    )
    cells = moved.sample(40, rng=default_rng(2))
    differs = cells != network.sample(40, rng=default_rng(2))
    assert cells[:, 3, 20].all()
    differs[:, 3, 20] = False
    assert not differs.any()


def test_walls_are_where_both_fields_of_a_pair_are_positive() -> None:
    fields = torch.randn(5, 4, 30, 30)
    found = Bands()(fields).reshape(5, 30, 30) > 0
    first, second = (fields[:, :2] > 0).all(dim=1), (fields[:, 2:] > 0).all(dim=1)
    assert torch.equal(found, first | second)
    single = torch.randn(5, 1, 30, 30)
    assert torch.equal(Bands()(single), single.flatten(1))


def test_cells_kept_free_stay_free_until_they_are_let_go() -> None:
    generator = used_generator("gan")
    kept = np.zeros((30, 30), dtype=np.bool_)
    kept[0, 5:9] = True
    keep_free(generator, kept)
    drawn = as_network(generator, leaky_slope=SLOPE).sample(300, rng=default_rng(0))
    assert not drawn[:, kept].any()
    keep_free(generator, np.zeros_like(kept))
    drawn = as_network(generator, leaky_slope=SLOPE).sample(300, rng=default_rng(0))
    assert drawn[:, kept].any()


def test_specks_are_left_out_and_obstacles_are_not() -> None:
    """Against a count of each obstacle's cells, one at a time."""
    cells = default_rng(0).random((40, 30, 30)) < 0.15
    expected = np.zeros_like(cells)
    for kept, place in zip(expected, cells, strict=True):
        labels, count = ndimage.label(place, np.ones((3, 3)))
        for number in range(1, count + 1):
            if (labels == number).sum() >= 4:
                kept |= labels == number
    assert np.array_equal(without_specks(cells, least=4), expected)
    assert np.array_equal(without_specks(cells, least=1), cells)
    empty = np.zeros((2, 30, 30), dtype=np.bool_)
    assert not without_specks(empty, least=4).any()


def test_specks_are_left_out_of_samples() -> None:
    network = as_network(used_generator("gan"), leaky_slope=SLOPE)
    without = replace(network, least_obstacle=5)
    expected = without_specks(network.sample(30, rng=default_rng(4)), least=5)
    assert np.array_equal(without.sample(30, rng=default_rng(4)), expected)
    assert np.array_equal(
        network_from_arrays(without.arrays()).sample(30, rng=default_rng(4)), expected
    )
