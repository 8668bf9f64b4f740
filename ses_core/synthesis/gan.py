"""SES-GAN, fitted with torch: the paper's two multilayer perceptrons (sections III-C, IV-C).

The paper gives the layers, the prior, the loss and the threshold. It leaves open, and
`GanSettings` therefore holds: the length of the noise vector, epochs, batch size, learning
rate, Adam's first decay, the slope of the leaky ReLUs. Fixed here: Adam's second decay 0.999,
torch's own initial weights, and that D normalizes real and generated halves as one batch.

The last is no matter of taste: D's last hidden layer is normalized too, so the mean output
over a normalized batch is the output bias. Halves normalized apart therefore have the same
mean, whatever D learns, and G is taught nothing (measured: noise of 70 blobs, none crossable).
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor, nn
from torch.nn import functional

from ses_core.arrays import Float32Array
from ses_core.navigation import NavigationDomain
from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.synthesis.generator_network import GeneratorNetwork, HiddenLayer
from ses_core.synthesis_settings import GanSettings

PIXELS = ENVIRONMENT_CELLS**2
GENERATOR_LAYERS = (256, 512, 1024)
DISCRIMINATOR_LAYERS = (512, 256, 256)
DROPOUT = 0.5


@dataclass(frozen=True, slots=True)
class Gan:
    """Trains generator and discriminator against each other."""

    settings: GanSettings

    def fit(
        self, domain: NavigationDomain, *, rng: Generator, progress: Callable[[float], None]
    ) -> GeneratorNetwork:
        """Train on occupied = +1, free = -1; equal seeds give equal weights.

        Leaves torch's random state and thread count as they were.
        """
        signs = np.where(domain.cells(), np.float32(1.0), np.float32(-1.0))
        with _one_seeded_thread(int(rng.integers(2**63))):
            real = torch.from_numpy(signs.reshape(len(signs), PIXELS))
            generator = build_generator(self.settings)
            _train(generator, build_discriminator(self.settings), real, self.settings, progress)
            return as_network(generator, leaky_slope=self.settings.leaky_slope)


def build_generator(settings: GanSettings) -> nn.Sequential:
    """Lay out G: hidden layers with batch normalization and leaky ReLU, then tanh."""
    layers: list[nn.Module] = []
    size = settings.latent_size
    for width in GENERATOR_LAYERS:
        layers += [
            nn.Linear(size, width),
            nn.BatchNorm1d(width),
            nn.LeakyReLU(settings.leaky_slope, inplace=True),
        ]
        size = width
    return nn.Sequential(*layers, nn.Linear(size, PIXELS), nn.Tanh())


def build_discriminator(settings: GanSettings) -> nn.Sequential:
    """Lay out D: leaky ReLU, batch normalization and dropout after each layer.

    Gives logits: the sigmoid that makes them probabilities is in the loss.
    """
    layers: list[nn.Module] = []
    size = PIXELS
    for width in DISCRIMINATOR_LAYERS:
        layers += [
            nn.Linear(size, width),
            nn.LeakyReLU(settings.leaky_slope, inplace=True),
            nn.BatchNorm1d(width),
            nn.Dropout(DROPOUT, inplace=True),
        ]
        size = width
    return nn.Sequential(*layers, nn.Linear(size, 1))


def as_network(generator: nn.Sequential, *, leaky_slope: float) -> GeneratorNetwork:
    """Take the weights out of a trained generator, as it evaluates (running statistics)."""
    modules = list(generator)
    output = modules[-2]
    assert isinstance(output, nn.Linear)
    return GeneratorNetwork(
        hidden=tuple(
            _hidden_layer(linear, norm)
            for linear, norm in zip(modules[0:-2:3], modules[1:-2:3], strict=True)
        ),
        weight=_array(output.weight.T),
        bias=_array(output.bias),
        leaky_slope=leaky_slope,
    )


def _hidden_layer(linear: nn.Module, norm: nn.Module) -> HiddenLayer:
    assert isinstance(linear, nn.Linear)
    assert isinstance(norm, nn.BatchNorm1d)
    assert norm.running_mean is not None
    assert norm.running_var is not None
    scale = norm.weight / torch.sqrt(norm.running_var + norm.eps)
    return HiddenLayer(
        weight=_array(linear.weight.T),
        bias=_array(linear.bias),
        scale=_array(scale),
        shift=_array(norm.bias - norm.running_mean * scale),
    )


def _train(
    generator: nn.Sequential,
    discriminator: nn.Sequential,
    real: Tensor,
    settings: GanSettings,
    progress: Callable[[float], None],
) -> None:
    """Alternate one update of D and one of G on the same real and generated environments."""
    batch_size = min(settings.batch_size, len(real))
    per_epoch = len(real) // batch_size
    epochs = max(settings.epochs, math.ceil(settings.least_updates / per_epoch))
    betas = (settings.adam_beta1, 0.999)
    weights_g = list(generator.parameters())
    optimiser_g = torch.optim.Adam(weights_g, lr=settings.learning_rate, betas=betas, fused=True)
    optimiser_d = torch.optim.Adam(
        discriminator.parameters(), lr=settings.learning_rate, betas=betas, fused=True
    )
    for epoch in range(epochs):
        order = torch.randperm(len(real))
        # The rest of an epoch, too small for a batch, has its turn in another shuffle.
        for number in range(per_epoch):
            batch = real[order[number * batch_size : (number + 1) * batch_size]]
            fake = generator(torch.randn(batch_size, settings.latent_size))

            loss_d = discriminator_loss(discriminator(torch.cat((batch, fake.detach()))))
            optimiser_d.zero_grad(set_to_none=True)
            torch.autograd.backward(loss_d)
            optimiser_d.step()

            loss_g = generator_loss(discriminator(torch.cat((batch, fake))), loss=settings.loss)
            optimiser_g.zero_grad(set_to_none=True)
            torch.autograd.backward(loss_g, inputs=weights_g)
            optimiser_g.step()
        progress((epoch + 1) / epochs)


def discriminator_loss(logits: Tensor) -> Tensor:
    """Equation 1 for D, negated, of the logits (2 B, 1) of a real and a generated half."""
    real, fake = logits.chunk(2)
    return functional.softplus(-real).mean() + functional.softplus(fake).mean()


def generator_loss(logits: Tensor, *, loss: str) -> Tensor:
    """Equation 1's log(1 - D(G(z))) of the generated half, or the non-saturating -log D(G(z))."""
    fake = logits.chunk(2)[1]
    if loss == "saturating":
        return -functional.softplus(fake).mean()
    return functional.softplus(-fake).mean()


@contextmanager
def _one_seeded_thread(seed: int) -> Iterator[None]:
    """Run torch on one thread from a seed, and put back what was there before."""
    threads = torch.get_num_threads()
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        torch.set_num_threads(1)
        try:
            yield
        finally:
            torch.set_num_threads(threads)


def _array(tensor: Tensor) -> Float32Array:
    return np.ascontiguousarray(tensor.detach().numpy(), dtype=np.float32)
