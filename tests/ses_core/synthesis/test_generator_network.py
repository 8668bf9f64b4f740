from collections.abc import Callable

import numpy as np
import pytest
import torch
from numpy.random import default_rng
from torch import nn

from ses_core.synthesis import gan_networks, gan_paper
from ses_core.synthesis.generator_modules import as_network, load_network
from ses_core.synthesis.generator_network import (
    SAMPLES_AT_ONCE,
    GeneratorNetwork,
    network_from_arrays,
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


def test_a_network_keeps_its_sign_per_cell() -> None:
    """A bias of one cell moves that cell alone: rows, columns and order are not mixed up."""
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
