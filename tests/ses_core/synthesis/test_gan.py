import numpy as np
import torch
from numpy.random import default_rng

from ses_core.synthesis.gan import (
    Gan,
    as_network,
    build_discriminator,
    build_generator,
    discriminator_loss,
    generator_loss,
)
from ses_core.synthesis.generator_network import SAMPLES_AT_ONCE
from ses_core.synthesis_settings import GanSettings
from tests.ses_core.synthesis.places import domain_of, rooms

SETTINGS = GanSettings()


def layers(network: torch.nn.Sequential) -> list[str]:
    return [
        f"{module.in_features}-{module.out_features}"
        if isinstance(module, torch.nn.Linear)
        else f"dropout {module.p}"
        if isinstance(module, torch.nn.Dropout)
        else type(module).__name__
        for module in network
    ]


def test_generator_has_the_layers_of_the_paper() -> None:
    hidden = ["BatchNorm1d", "LeakyReLU"]
    assert layers(build_generator(SETTINGS)) == [
        *("64-256", *hidden),
        *("256-512", *hidden),
        *("512-1024", *hidden),
        *("1024-900", "Tanh"),
    ]


def test_discriminator_has_the_layers_of_the_paper() -> None:
    hidden = ["LeakyReLU", "BatchNorm1d", "dropout 0.5"]
    assert layers(build_discriminator(SETTINGS)) == [
        *("900-512", *hidden),
        *("512-256", *hidden),
        *("256-256", *hidden),
        "256-1",
    ]


def test_numpy_network_equals_the_torch_generator_with_running_statistics() -> None:
    torch_state = torch.random.get_rng_state()
    generator = build_generator(SETTINGS)
    for _ in range(5):
        generator(1.0 + 2.0 * torch.randn(32, 64))
    noise = torch.randn(300, 64)
    network = as_network(generator, leaky_slope=SETTINGS.leaky_slope)
    generator.eval()
    with torch.no_grad():
        expected = generator(noise).numpy()
    torch.random.set_rng_state(torch_state)
    assert np.abs(network.images(noise.numpy()) - expected).max() < 1e-5


def test_samples_do_not_depend_on_how_many_are_computed_at_once() -> None:
    network = as_network(build_generator(SETTINGS), leaky_slope=SETTINGS.leaky_slope)
    count = SAMPLES_AT_ONCE + 5
    cells = network.sample(count, rng=default_rng(0))
    noise = default_rng(0).standard_normal((count, 64), dtype=np.float32)
    images = network.images(noise).reshape(count, 30, 30)
    clear = np.abs(images) > 1e-5
    assert np.array_equal(cells[clear], (images > 0)[clear])


def test_training_learns_where_the_walls_are() -> None:
    """Every place has a wall on the left and an open right half; noise has neither."""
    cells = rooms(64)
    cells[:, :, :6] = True
    cells[:, :, 15:] = False
    settings = GanSettings(epochs=60, least_updates=1, learning_rate=1e-3, latent_size=8)
    fitted = Gan(settings).fit(domain_of(cells), rng=default_rng(0), progress=lambda _: None)
    drawn = fitted.sample(200, rng=default_rng(1))
    assert drawn[:, :, :6].mean() > drawn[:, :, 15:].mean() + 0.3
    assert len({place.tobytes() for place in drawn}) > 20


def test_losses_are_those_of_equation_1() -> None:
    logits = torch.tensor([[0.3], [-1.2], [2.0], [0.7]])
    real, fake = torch.sigmoid(logits[:2]), torch.sigmoid(logits[2:])
    value = real.log().mean() + (1.0 - fake).log().mean()
    assert torch.allclose(discriminator_loss(logits), -value)
    saturating = (1.0 - fake).log().mean()
    assert torch.allclose(generator_loss(logits, loss="saturating"), saturating)
    assert torch.allclose(generator_loss(logits, loss="non-saturating"), -fake.log().mean())


def test_fitting_leaves_torch_as_it_was() -> None:
    threads, state = torch.get_num_threads(), torch.random.get_rng_state()
    settings = GanSettings(epochs=1, least_updates=2)
    Gan(settings).fit(domain_of(rooms(10)), rng=default_rng(0), progress=lambda _: None)
    assert torch.get_num_threads() == threads
    assert torch.equal(torch.random.get_rng_state(), state)


def test_few_environments_still_get_the_least_number_of_updates() -> None:
    heard: list[float] = []
    settings = GanSettings(epochs=1, least_updates=9)
    Gan(settings).fit(domain_of(rooms(10)), rng=default_rng(0), progress=heard.append)
    assert len(heard) == 9
