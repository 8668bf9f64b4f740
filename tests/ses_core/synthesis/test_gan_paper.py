import numpy as np
import pytest
import torch
from numpy.random import default_rng

from ses_core.synthesis.gan_paper import (
    ByteDropout,
    GanPaper,
    build_discriminator,
    build_generator,
    judge,
)
from ses_core.synthesis.generator_network import GeneratorNetwork
from ses_core.synthesis.seeded_torch import one_seeded_thread
from ses_core.synthesis_settings import GanPaperSettings
from tests.ses_core.synthesis.places import domain_of, rooms

SETTINGS = GanPaperSettings()


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


def test_the_loss_as_printed_is_the_default() -> None:
    assert SETTINGS.loss == "saturating"


def test_halves_normalized_apart_cannot_be_told_apart_on_average() -> None:
    """Nothing but the dropout after it keeps the last normalization from hiding all."""
    with one_seeded_thread(0):
        discriminator = build_discriminator(SETTINGS)
        for module in discriminator:
            if isinstance(module, torch.nn.Dropout):
                module.p = 0.0
        real, fake = 3.0 + torch.randn(32, 900), torch.randn(32, 900)
        means = {
            normalizes: [
                half.mean().item()
                for half in judge(discriminator, real, fake, normalizes=normalizes)
            ]
            for normalizes in ("together", "apart")
        }
    assert abs(means["apart"][0] - means["apart"][1]) < 1e-5
    assert abs(means["together"][0] - means["together"][1]) > 1e-2


@pytest.mark.parametrize(("loss", "apart"), [("saturating", 0.1), ("non-saturating", 0.3)])
def test_training_learns_where_the_walls_are(loss: str, apart: float) -> None:
    """Every place has a wall on the left and an open right half; noise has neither."""
    cells = rooms(64)
    cells[:, :, :6] = True
    cells[:, :, 15:] = False
    settings = GanPaperSettings(
        epochs=150, least_updates=1, learning_rate=1e-3, latent_size=8, loss=loss
    )
    fitted = GanPaper(settings).fit(domain_of(cells), rng=default_rng(0), progress=lambda _: None)
    drawn = fitted.sample(200, rng=default_rng(1))
    assert drawn[:, :, :6].mean() > drawn[:, :, 15:].mean() + apart
    assert len({place.tobytes() for place in drawn}) > 20


def test_fitting_leaves_torch_as_it_was() -> None:
    threads, state = torch.get_num_threads(), torch.random.get_rng_state()
    fit(GanPaperSettings(epochs=1, least_updates=2))
    assert torch.get_num_threads() == threads
    assert torch.equal(torch.random.get_rng_state(), state)


def test_few_environments_still_get_the_least_number_of_updates() -> None:
    heard: list[float] = []
    settings = GanPaperSettings(epochs=1, least_updates=9)
    GanPaper(settings).fit(domain_of(rooms(10)), rng=default_rng(0), progress=heard.append)
    assert len(heard) == 9
    assert heard[-1] == 1.0


def test_a_warm_start_goes_on_from_the_earlier_generator() -> None:
    settings = GanPaperSettings(epochs=1, least_updates=1, learning_rate=1e-9)
    start = fit(GanPaperSettings(epochs=20, least_updates=1, learning_rate=1e-3))
    warm, cold = fit(settings, start=start), fit(settings)
    drawn = [network.sample(100, rng=default_rng(3)) for network in (start, warm, cold)]
    assert (drawn[1] != drawn[0]).mean() < 0.1 < (drawn[2] != drawn[0]).mean()


def fit(settings: GanPaperSettings, *, start: GeneratorNetwork | None = None) -> GeneratorNetwork:
    return GanPaper(settings).fit(
        domain_of(rooms(40)), rng=default_rng(0), progress=lambda _: None, start=start
    )


def test_equal_seeds_give_equal_bytes() -> None:
    settings = GanPaperSettings(epochs=2, least_updates=1)
    first, second = fit(settings).arrays(), fit(settings).arrays()
    assert all(np.array_equal(first[name], second[name]) for name in first)


@pytest.mark.parametrize("share", [0.25, 0.5])
def test_dropout_drops_its_share_of_each_place(share: float) -> None:
    dropout = ByteDropout(share)
    with one_seeded_thread(0):
        kept = torch.stack([dropout(torch.ones(5, 13)) for _ in range(4000)])
    assert sorted(set(kept.reshape(-1).tolist())) == pytest.approx([0.0, 1.0 / (1.0 - share)])
    assert (kept.mean(dim=0) - 1.0).abs().max() < 0.08
    flat = (kept > 0).reshape(4000, -1).float()
    assert (torch.corrcoef(flat.T) - torch.eye(65)).abs().max() < 0.08
    dropout.eval()
    assert torch.equal(dropout(torch.ones(3)), torch.ones(3))
