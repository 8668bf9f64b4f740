"""Between generators that torch trains and the ones numpy draws from: out, and in again."""

from typing import cast

import numpy as np
import torch
from torch import Tensor, nn

from ses_core.arrays import BoolArray, Float32Array
from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.synthesis.generator_network import DenseLayer, GeneratorNetwork, UpsamplingLayer

_CALIBRATION_DRAWS = 1024
"""From which a loaded layer's mean and deviation are measured."""

FREE_FOR_GOOD = -20.0
"""Bias of a cell that must not become occupied: values are mostly below 1, and tanh is flat."""

Weighted = nn.Linear | nn.ConvTranspose2d
Norm = nn.BatchNorm1d | nn.BatchNorm2d


class AsImage(nn.Module):
    """(N, side * side * C) to (N, C, side, side), channels last in memory as numpy has them."""

    def __init__(self, side: int) -> None:
        """Take the side [cells]."""
        super().__init__()
        self.side = side

    def forward(self, values: Tensor) -> Tensor:
        """Look at the values as an image."""
        return values.view(len(values), self.side, self.side, -1).permute(0, 3, 1, 2)


class PositionBias(nn.Module):
    """(N, C, 30, 30) plus a bias for every cell of an environment."""

    def __init__(self, channels: int) -> None:
        """Start from nothing."""
        super().__init__()
        self.bias = nn.Parameter(torch.zeros(channels, ENVIRONMENT_CELLS, ENVIRONMENT_CELLS))

    def forward(self, image: Tensor) -> Tensor:
        """Add it."""
        return image + self.bias


class Bands(nn.Module):
    """(N, 2 P, 30, 30) to (N, 900): the highest of P pairs, each as high as its lower half."""

    def forward(self, image: Tensor) -> Tensor:
        """Join the fields."""
        count, channels = image.shape[:2]
        pairs = image.reshape(count, -1, min(channels, 2), ENVIRONMENT_CELLS**2)
        return pairs.amin(dim=2).amax(dim=1)


def keep_free(generator: nn.Sequential, cells: BoolArray) -> None:
    """Let some cells (30, 30) of what a generator draws be free for good, and no others.

    A cell that no real environment has occupied, as where robots start and arrive, needs no
    learning. Others are let go that an earlier fit, of other environments, kept free.
    """
    kept = torch.from_numpy(cells.copy())
    with torch.no_grad():
        for module in generator:
            if isinstance(module, PositionBias):
                module.bias[(module.bias < FREE_FOR_GOOD / 2.0) & ~kept] = 0.0
                module.bias[:, kept] = FREE_FOR_GOOD


def as_network(generator: nn.Sequential, *, leaky_slope: float) -> GeneratorNetwork:
    """Take the weights out of a trained generator, as it evaluates (running statistics)."""
    layers: list[DenseLayer | UpsamplingLayer] = []
    modules = [*generator]
    with torch.no_grad():
        for module, after in zip(modules, [*modules[1:], None], strict=True):
            if not isinstance(module, Weighted):
                continue
            weight = module.weight.T if isinstance(module, nn.Linear) else module.weight
            bias = torch.zeros(weight.shape[1]) if module.bias is None else module.bias
            if isinstance(after, Norm):
                weight, bias = _folded(weight, bias, after)
            if isinstance(after, PositionBias):
                bias = after.bias.permute(1, 2, 0)
            kind = DenseLayer if isinstance(module, nn.Linear) else UpsamplingLayer
            layers.append(kind(weight=_float32(weight), bias=_float32(bias)))
    return GeneratorNetwork(layers=tuple(layers), leaky_slope=leaky_slope)


def load_network(generator: nn.Sequential, network: GeneratorNetwork) -> None:
    """Take over the weights of an earlier fit, layer by layer where their shapes agree.

    Its batch normalization is folded into its weights. What a loaded layer gives is therefore
    measured on noise, and made the scale and shift of the normalization that follows: so the
    generator draws what the network draws, and goes on from there.
    """
    stored = list(network.layers)
    first = generator[0]
    assert isinstance(first, nn.Linear)
    values = torch.randn(_CALIBRATION_DRAWS, first.in_features)
    is_loaded = False
    with torch.no_grad():
        for module in generator:
            if isinstance(module, Weighted):
                layer = stored.pop(0) if stored else None
                is_loaded = layer is not None and _load(module, layer)
            elif isinstance(module, PositionBias) and is_loaded and layer is not None:
                module.bias.copy_(torch.from_numpy(layer.bias).permute(2, 0, 1))
            elif isinstance(module, Norm) and is_loaded:
                _calibrate(module, values)
            values = module(values)


def _load(module: Weighted, layer: DenseLayer | UpsamplingLayer) -> bool:
    """Copy a layer's weights if their shapes agree, and tell whether they do."""
    weight = module.weight.T if isinstance(module, nn.Linear) else module.weight
    if tuple(weight.shape) != layer.weight.shape:
        return False
    if module.bias is not None and tuple(module.bias.shape) != layer.bias.shape:
        return False
    weight.copy_(torch.from_numpy(layer.weight))
    if module.bias is not None:
        module.bias.copy_(torch.from_numpy(layer.bias))
    return True


def _calibrate(norm: Norm, values: Tensor) -> None:
    """Make a normalization give back what comes in: (N, D) or (N, D, side, side)."""
    others = [axis for axis in range(values.dim()) if axis != 1]
    variance, mean = torch.var_mean(values, dim=others, correction=0)
    norm.weight.copy_(torch.sqrt(variance + norm.eps))
    norm.bias.copy_(mean)
    cast("Tensor", norm.running_mean).copy_(mean)
    cast("Tensor", norm.running_var).copy_(variance)


def _folded(weight: Tensor, bias: Tensor, norm: Norm) -> tuple[Tensor, Tensor]:
    """Fold a normalization, as it evaluates, into the weight (C, D, ...) and bias (D,) before."""
    mean, variance = cast("Tensor", norm.running_mean), cast("Tensor", norm.running_var)
    scale = norm.weight / torch.sqrt(variance + norm.eps)
    shape = (1, -1) + (1,) * (weight.dim() - 2)
    return weight * scale.reshape(shape), (bias - mean) * scale + norm.bias


def _float32(tensor: Tensor) -> Float32Array:
    return np.array(tensor.numpy(), dtype=np.float32, order="C")
