"""The training of the mended GAN, pass by pass over the real environments."""

import copy
import math
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from ses_core.arrays import BoolArray
from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.scorecard.distances import mirrored
from ses_core.synthesis.adversarial_losses import discriminator_loss, generator_loss
from ses_core.synthesis.gan_networks import (
    binarized,
    build_discriminator,
    build_generator,
    slope_penalty,
)
from ses_core.synthesis.generator_modules import as_network, keep_free, load_network
from ses_core.synthesis.generator_network import GeneratorNetwork
from ses_core.synthesis_settings import GanSettings

ADAM_BETA2 = 0.99
"""Second-moment decay of both optimisers: a memory of some hundred updates of some thousands."""


class GanTraining:
    """Both networks, their optimisers, and the running average of the generator's weights."""

    def __init__(
        self, cells: BoolArray, settings: GanSettings, start: GeneratorNetwork | None
    ) -> None:
        """Begin with environments (N, 30, 30), from an earlier generator if there is one."""
        self.settings = settings
        self.real = torch.from_numpy(cells[:, None]).float() * 2.0 - 1.0
        self.batch_size = min(settings.batch_size, len(cells))
        self.batches = len(cells) // self.batch_size
        self.epochs = max(settings.epochs, math.ceil(settings.least_updates / self.batches))
        self.updates = 0
        self.generator = build_generator(settings)
        if start is not None:
            load_network(self.generator, start)
        shown = np.concatenate((cells, mirrored(cells))) if settings.mirrored else cells
        keep_free(self.generator, np.logical_not(np.any(shown, axis=0)))
        self.averaged = copy.deepcopy(self.generator)
        self._averages = [
            (average, weight)
            for average, weight in zip(
                self.averaged.state_dict().values(),
                self.generator.state_dict().values(),
                strict=True,
            )
            if average.is_floating_point()
        ]
        self.discriminator = build_discriminator(settings)
        betas = (settings.adam_beta1, ADAM_BETA2)
        self.generator_weights = list(self.generator.parameters())
        self.generator_optimiser = torch.optim.Adam(
            self.generator_weights, lr=settings.learning_rate, betas=betas, fused=True
        )
        self.discriminator_optimiser = torch.optim.Adam(
            self.discriminator.parameters(), lr=settings.learning_rate, betas=betas, fused=True
        )

    def network(self) -> GeneratorNetwork:
        """Give the averaged generator as it is now."""
        network = as_network(self.averaged, leaky_slope=self.settings.leaky_slope)
        return replace(network, least_obstacle=self.settings.least_obstacle)

    def epoch(self) -> None:
        """Go once through the real environments, but for a rest too small for a batch."""
        left = 1.0 - self.updates / (self.epochs * self.batches)
        rate = self.settings.learning_rate * min(1.0, left / self.settings.decay_share)
        for optimiser in (self.generator_optimiser, self.discriminator_optimiser):
            for group in optimiser.param_groups:
                group["lr"] = rate
        order = torch.randperm(len(self.real))
        for number in range(self.batches):
            chosen = order[number * self.batch_size : (number + 1) * self.batch_size]
            self._update(self.real[chosen])

    def _update(self, real: Tensor) -> None:
        """Update D and then G on the same generated environments, and average G."""
        settings = self.settings
        if settings.mirrored:
            is_mirrored = torch.rand(len(real), 1, 1, 1) < 0.5
            real = torch.where(is_mirrored, real.flip(3), real)
        noise = torch.randn(len(real), settings.latent_size)
        fake = binarized(self.generator(noise))
        both = shifted(torch.cat((real, fake.detach())), most=settings.most_shift)

        loss_d = discriminator_loss(*self.discriminator(both).chunk(2))
        if settings.r1_weight > 0.0 and self.updates % settings.r1_interval == 0:
            # Only now and then, and so much stronger: it costs as much as the loss itself.
            penalty = slope_penalty(self.discriminator, both[: len(real)])
            loss_d = loss_d + settings.r1_weight * settings.r1_interval * penalty
        self.discriminator_optimiser.zero_grad(set_to_none=True)
        torch.autograd.backward(loss_d)
        self.discriminator_optimiser.step()

        judged = self.discriminator(shifted(fake, most=settings.most_shift))
        self.generator_optimiser.zero_grad(set_to_none=True)
        torch.autograd.backward(
            generator_loss(judged, loss="non-saturating"), inputs=self.generator_weights
        )
        self.generator_optimiser.step()
        for average, weight in self._averages:
            average.lerp_(weight, 1.0 - settings.average_decay)
        self.updates += 1


def shifted(images: Tensor, *, most: int) -> Tensor:
    """Shift images (N, 1, 30, 30) all alike by up to so many cells; 0 is what moves in."""
    if most == 0:
        return images
    y, x = torch.randint(2 * most + 1, (2,)).tolist()
    padded = functional.pad(images, (most, most, most, most))
    return padded[:, :, y : y + ENVIRONMENT_CELLS, x : x + ENVIRONMENT_CELLS]
