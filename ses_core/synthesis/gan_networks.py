"""The networks of the mended GAN: a few fully connected layers, then convolutions.

Where an obstacle stands is settled by fully connected layers, on 8 x 8 coarse cells; what it
looks like by convolutions, which are the same everywhere. A perceptron would have to learn at
every cell by itself that a lone occupied one is no obstacle: the paper's speckle.

A wall that a scanner has seen is a line one or two cells wide. G draws it as the band where
two smooth fields are both positive, which hangs together by itself; a single field would have
to be a ridge along it. What is filled is a wide band.
"""

import torch
from torch import Tensor, nn

from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.synthesis.generator_modules import AsImage, Bands, PositionBias
from ses_core.synthesis.generator_network import KERNEL, upsampling_padding
from ses_core.synthesis_settings import GanSettings

COARSE_SIDE = 8
"""Doubled twice this is 32, of which the middle 30 are kept."""


def build_generator(settings: GanSettings) -> nn.Sequential:
    """Lay out G: noise (N, latent) to values (N, 900), occupied where positive."""
    slope = settings.leaky_slope
    coarse, fine = settings.generator_channels
    fields = max(2 * settings.generator_bands, 1)
    hidden, spread = settings.generator_hidden, COARSE_SIDE**2 * coarse
    generator = nn.Sequential(
        nn.Linear(settings.latent_size, hidden),
        nn.BatchNorm1d(hidden),
        nn.LeakyReLU(slope, inplace=True),
        nn.Linear(hidden, spread),
        nn.BatchNorm1d(spread),
        nn.LeakyReLU(slope, inplace=True),
        AsImage(COARSE_SIDE),
        nn.ConvTranspose2d(coarse, fine, KERNEL, 2, upsampling_padding(COARSE_SIDE)),
        nn.BatchNorm2d(fine),
        nn.LeakyReLU(slope, inplace=True),
        nn.ConvTranspose2d(
            fine, fields, KERNEL, 2, upsampling_padding(2 * COARSE_SIDE), bias=False
        ),
        PositionBias(fields),
        Bands(),
    )
    for module in generator:
        if isinstance(module, nn.ConvTranspose2d):
            _begin_smooth(module)
    return generator


def _begin_smooth(layer: nn.ConvTranspose2d) -> None:
    """Begin with bilinear interpolation of randomly mixed channels: blobs, not a chessboard."""
    ramp = torch.tensor([0.25, 0.75, 0.75, 0.25])
    mixing = torch.randn(layer.in_channels, layer.out_channels) / layer.in_channels**0.5
    with torch.no_grad():
        layer.weight.copy_(mixing[:, :, None, None] * ramp[:, None] * ramp[None, :])


def build_discriminator(settings: GanSettings) -> nn.Sequential:
    """Lay out D: images (N, 1, 30, 30) of -1 and +1 to logits (N, 1).

    No batch normalization: an environment is judged by itself, so R1 holds for each.
    """
    slope = settings.leaky_slope
    fine, coarse = settings.discriminator_channels
    hidden = settings.discriminator_hidden
    return nn.Sequential(
        nn.Conv2d(1, fine, KERNEL, 2, upsampling_padding(2 * COARSE_SIDE)),
        nn.LeakyReLU(slope, inplace=True),
        nn.Conv2d(fine, coarse, KERNEL, 2, upsampling_padding(COARSE_SIDE)),
        nn.LeakyReLU(slope, inplace=True),
        nn.Flatten(),
        nn.Linear(COARSE_SIDE**2 * coarse, hidden),
        nn.LeakyReLU(slope, inplace=True),
        nn.Linear(hidden, 1),
    )


def binarized(values: Tensor) -> Tensor:
    """Make values (N, 900) images (N, 1, 30, 30) of -1 and +1, as they will be used.

    Straight-through: the gradient is that of the tanh which the step stands for.
    """
    soft = torch.tanh(values)
    hard = torch.where(values > 0.0, 1.0, -1.0)
    return (soft + (hard - soft).detach()).view(-1, 1, ENVIRONMENT_CELLS, ENVIRONMENT_CELLS)


def slope_penalty(discriminator: nn.Module, real: Tensor) -> Tensor:
    """R1: the mean squared slope of D's logit at real images (B, 1, 30, 30), halved."""
    at = real.detach().clone().requires_grad_()
    (slopes,) = torch.autograd.grad(discriminator(at).sum(), at, create_graph=True)
    return 0.5 * slopes.square().sum(dim=(1, 2, 3)).mean()
