"""SES-GAN as printed, fitted with torch: two multilayer perceptrons (sections III-C, IV-C).

The paper gives the layers, the prior, the loss and the threshold. What it leaves open is a
setting of `GanPaperSettings`; fixed here are Adam's second decay of 0.999 and torch's own
initial weights.

One of these settings is no matter of taste: whether D normalizes real and generated halves
as one batch. D's last hidden layer is normalized too, so the mean output over a normalized
batch is the output bias. Halves normalized apart therefore have the same mean, whatever D
learns, and G is taught nothing (measured: noise of 70 blobs, none crossable).
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor, nn

from ses_core.navigation import NavigationDomain
from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.protocols import FittedSynthesizer
from ses_core.synthesis.adversarial_losses import discriminator_loss, generator_loss
from ses_core.synthesis.generator_modules import as_network, load_network
from ses_core.synthesis.generator_network import GeneratorNetwork
from ses_core.synthesis.seeded_torch import one_seeded_thread
from ses_core.synthesis_settings import GanPaperSettings

PIXELS = ENVIRONMENT_CELLS**2
GENERATOR_LAYERS = (256, 512, 1024)
DISCRIMINATOR_LAYERS = (512, 256, 256)
DROPOUT = 0.5


@dataclass(frozen=True, slots=True)
class GanPaper:
    """Trains generator and discriminator against each other."""

    settings: GanPaperSettings

    def fit(
        self,
        domain: NavigationDomain,
        *,
        rng: Generator,
        progress: Callable[[float], None],
        start: FittedSynthesizer | None = None,
    ) -> GeneratorNetwork:
        """Train on occupied = +1, free = -1; equal seeds give equal weights.

        A warm start takes the generator's weights from an earlier fit, layer by layer where
        their shapes agree. An earlier fit holds no discriminator: this one begins anew and
        pulls at a good generator before it can judge, so the first epochs make it worse.

        Leaves torch's random state and thread count as they were.
        """
        signs = np.where(domain.cells(), np.float32(1.0), np.float32(-1.0))
        with one_seeded_thread(int(rng.integers(2**63))):
            real = torch.from_numpy(signs.reshape(len(signs), PIXELS))
            generator = build_generator(self.settings)
            if isinstance(start, GeneratorNetwork):
                load_network(generator, start)
            for share in train(
                generator, build_discriminator(self.settings), real, settings=self.settings
            ):
                progress(share)
            return as_network(generator, leaky_slope=self.settings.leaky_slope)


def build_generator(settings: GanPaperSettings) -> nn.Sequential:
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


class ByteDropout(nn.Dropout):
    """Dropout of whole 256ths, of which a random number of 64 bits decides eight.

    Torch's own draws a number for each and takes a sixth of the fit's time for it.
    """

    def forward(self, values: Tensor) -> Tensor:
        """Drop some of the values while training, and make up for it."""
        if not self.training or self.p == 0.0:
            return values
        count = values.numel()
        numbers = torch.empty(-(-count // 8), dtype=torch.int64).random_(-(2**63), None)
        drawn = numbers.view(torch.uint8)[:count].view_as(values)
        return values * (drawn >= round(256 * self.p)).to(values.dtype).div_(1.0 - self.p)


def build_discriminator(settings: GanPaperSettings) -> nn.Sequential:
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
            ByteDropout(DROPOUT),
        ]
        size = width
    return nn.Sequential(*layers, nn.Linear(size, 1))


def train(
    generator: nn.Sequential,
    discriminator: nn.Sequential,
    real: Tensor,
    *,
    settings: GanPaperSettings,
) -> Iterator[float]:
    """Alternate one update of D and one of G on the same real and generated environments.

    Yields:
        The share that is done, after each pass over the real ones (N, 900).
    """
    batch_size = min(settings.batch_size, len(real))
    per_epoch = len(real) // batch_size
    epochs = max(settings.epochs, math.ceil(settings.least_updates / per_epoch))
    betas = (settings.adam_beta1, 0.999)
    normalizes = settings.discriminator_normalizes
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

            judged = judge(discriminator, batch, fake.detach(), normalizes=normalizes)
            loss_d = discriminator_loss(*judged)
            optimiser_d.zero_grad(set_to_none=True)
            torch.autograd.backward(loss_d)
            optimiser_d.step()

            _, judged_fake = judge(discriminator, batch, fake, normalizes=normalizes)
            loss_g = generator_loss(judged_fake, loss=settings.loss)
            optimiser_g.zero_grad(set_to_none=True)
            torch.autograd.backward(loss_g, inputs=weights_g)
            optimiser_g.step()
        yield (epoch + 1) / epochs


def judge(
    discriminator: nn.Sequential, real: Tensor, fake: Tensor, *, normalizes: str
) -> tuple[Tensor, Tensor]:
    """Give D's logits (B, 1) of both halves, normalized `together` as one batch or `apart`."""
    if normalizes == "apart":
        return discriminator(real), discriminator(fake)
    judged_real, judged_fake = discriminator(torch.cat((real, fake))).chunk(2)
    return judged_real, judged_fake
