import numpy as np
import pytest
import torch
from numpy.random import default_rng
from torch import nn

from ses_core.synthesis.gan import Gan
from ses_core.synthesis.gan_networks import (
    binarized,
    build_discriminator,
    build_generator,
    slope_penalty,
)
from ses_core.synthesis.gan_training import GanTraining, shifted
from ses_core.synthesis.generator_network import GeneratorNetwork
from ses_core.synthesis.seeded_torch import one_seeded_thread
from ses_core.synthesis_settings import GanSettings
from tests.ses_core.synthesis.places import domain_of, rooms

SMALL = GanSettings(
    latent_size=8,
    generator_hidden=32,
    generator_channels=(8, 8),
    discriminator_channels=(8, 8),
    discriminator_hidden=16,
    epochs=2,
    least_updates=1,
    average_decay=0.9,
)


def changed(**updates: object) -> GanSettings:
    return SMALL.model_copy(update=updates)


def fit(
    settings: GanSettings, *, cells: np.ndarray | None = None, start: GeneratorNetwork | None = None
) -> GeneratorNetwork:
    return Gan(settings).fit(
        domain_of(rooms(64) if cells is None else cells),
        rng=default_rng(0),
        progress=lambda _: None,
        start=start,
    )


def test_both_networks_fit_an_environment() -> None:
    settings = GanSettings()
    values = build_generator(settings)(torch.randn(3, settings.latent_size))
    assert values.shape == (3, 900)
    assert build_discriminator(settings)(binarized(values)).shape == (3, 1)


def test_the_discriminator_judges_each_by_itself() -> None:
    images = torch.where(torch.rand(5, 1, 30, 30) < 0.5, 1.0, -1.0)
    discriminator = build_discriminator(SMALL)
    alone = torch.cat([discriminator(one[None]) for one in images])
    assert torch.allclose(discriminator(images), alone, atol=1e-5)


def test_the_discriminator_is_shown_binary_environments() -> None:
    """The values shown have the signs that `sample` goes by; the slope is that of the tanh."""
    values = torch.randn(4, 900, requires_grad=True)
    images = binarized(values)
    assert torch.equal(images.flatten(1) > 0, values > 0)
    assert torch.allclose(images.abs(), torch.ones(()))
    torch.autograd.backward(images.sum())
    assert values.grad is not None
    assert torch.allclose(values.grad, 1.0 - torch.tanh(values.detach()) ** 2, atol=1e-6)


def test_slope_penalty_is_half_the_squared_slope_of_each() -> None:
    linear = nn.Sequential(nn.Flatten(), nn.Linear(900, 1))
    (weight, _) = linear.parameters()
    found = slope_penalty(linear, torch.randn(6, 1, 30, 30))
    assert torch.allclose(found, 0.5 * weight.detach().square().sum())


def test_slope_penalty_can_be_trained_on() -> None:
    discriminator = build_discriminator(SMALL)
    torch.autograd.backward(slope_penalty(discriminator, torch.randn(6, 1, 30, 30)))
    first = next(discriminator.parameters())
    assert first.grad is not None
    assert first.grad.abs().max() > 0


def test_shifts_move_all_alike_and_are_as_likely_either_way() -> None:
    images = torch.where(torch.rand(2, 1, 30, 30) < 0.5, 1.0, -1.0)
    seen = set()
    with one_seeded_thread(0):
        for _ in range(400):
            moved = shifted(images, most=2)
            (y, x) = next(
                (y, x)
                for y in range(-2, 3)
                for x in range(-2, 3)
                if torch.equal(
                    moved[:, :, 2:28, 2:28], images[:, :, 2 + y : 28 + y, 2 + x : 28 + x]
                )
            )
            seen.add((y, x))
    assert len(seen) == 25
    assert torch.equal(shifted(images, most=0), images)


def test_training_learns_where_the_walls_are() -> None:
    """Every place has a wall on the left and an open right half; noise has neither."""
    cells = rooms(64)
    cells[:, :, :6] = True
    cells[:, :, 15:] = False
    settings = changed(epochs=120, learning_rate=2e-3, mirrored=False)
    drawn = fit(settings, cells=cells).sample(200, rng=default_rng(1))
    assert drawn[:, :, :6].mean() > drawn[:, :, 15:].mean() + 0.5
    assert len({place.tobytes() for place in drawn}) > 20


def test_mirrored_environments_are_learned_too() -> None:
    """All real ones have their wall on the left; half of what is drawn has it on the right."""
    cells = np.zeros((64, 30, 30), dtype=np.bool_)
    cells[:, :, :6] = True
    settings = changed(epochs=120, learning_rate=2e-3, most_shift=0)
    drawn = fit(settings, cells=cells).sample(200, rng=default_rng(1))
    assert drawn[:, :, 24:].mean() > 0.2
    assert drawn[:, :, :6].mean() > 0.2


def test_what_no_real_environment_has_occupied_is_never_occupied() -> None:
    """Nor its mirror image, where mirror images count."""
    cells = rooms(64)
    cells[:, :3, 5:9] = False
    cells[:, :3, 21:25] = False
    drawn = fit(SMALL, cells=cells).sample(200, rng=default_rng(1))
    assert not drawn[:, :3, 5:9].any()
    assert drawn.any()


def test_the_learning_rate_falls_to_nothing() -> None:
    with one_seeded_thread(0):
        training = GanTraining(rooms(64), changed(epochs=4, decay_share=0.5), None)
        rates = []
        for _ in range(4):
            training.epoch()
            rates.append(training.generator_optimiser.param_groups[0]["lr"])
    assert rates == pytest.approx([1e-3, 1e-3, 1e-3, 5e-4])


def test_fitting_leaves_torch_as_it_was() -> None:
    threads, state = torch.get_num_threads(), torch.random.get_rng_state()
    fit(SMALL)
    assert torch.get_num_threads() == threads
    assert torch.equal(torch.random.get_rng_state(), state)


def test_equal_seeds_give_equal_bytes() -> None:
    first, second = fit(SMALL).arrays(), fit(SMALL).arrays()
    assert all(np.array_equal(first[name], second[name]) for name in first)


def test_few_environments_still_get_the_least_number_of_updates() -> None:
    heard: list[float] = []
    Gan(changed(epochs=1, least_updates=9)).fit(
        domain_of(rooms(10)), rng=default_rng(0), progress=heard.append
    )
    assert heard == sorted(heard)
    assert len(heard) >= 9
    assert heard[-1] == 1.0


def test_a_warm_start_that_finds_nothing_better_gives_back_what_it_started_from() -> None:
    start = fit(changed(epochs=120, learning_rate=2e-3))
    warm = fit(changed(heldout_share=0.5, least_heldout=2, learning_rate=1e-9), start=start)
    drawn = [network.sample(200, rng=default_rng(3)) for network in (start, warm)]
    assert (drawn[0] != drawn[1]).mean() < 0.05


def test_the_averaged_generator_moves_less_than_the_trained_one() -> None:
    with one_seeded_thread(0):
        training = GanTraining(rooms(64), changed(average_decay=0.9999), None)
        training.epoch()
        before = training.network().layers[0].weight
        trained = next(training.generator.parameters()).detach().numpy().copy()
        for _ in range(5):
            training.epoch()
        moved = np.abs(training.network().layers[0].weight - before).max()
        apart = np.abs(next(training.generator.parameters()).detach().numpy() - trained).max()
    assert 0 < moved < apart / 10


@pytest.mark.parametrize("heldout_share", [0.0, 0.5])
def test_both_ways_of_ending_give_a_generator(heldout_share: float) -> None:
    settings = changed(heldout_share=heldout_share, least_heldout=2, patience=1)
    assert fit(settings).sample(3, rng=default_rng(0)).shape == (3, 30, 30)
