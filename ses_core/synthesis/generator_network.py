"""The generators of `gan` and `gan-paper` after training, in numpy alone: drawing needs no torch.

A layer is fully connected or doubles the side of an image. Batch normalization by running
statistics is folded into its weights, since nothing lies between the two.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ses_core.arrays import BoolArray, Float32Array
from ses_core.occupancy import ENVIRONMENT_CELLS

SAMPLES_AT_ONCE = 256
"""Bounds the memory of a forward pass to some tens of megabytes."""

KERNEL = 4
"""Side [cells] of an upsampling layer's kernel: each cell spreads over 4 x 4 finer ones."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DenseLayer:
    """Fully connected.

    Attributes:
        weight: (inputs, outputs).
        bias: (outputs,).
    """

    weight: Float32Array
    bias: Float32Array

    def __call__(self, values: Float32Array) -> Float32Array:
        """Map (N, inputs) to (N, outputs)."""
        return values @ self.weight + self.bias


@dataclass(frozen=True, slots=True, kw_only=True)
class UpsamplingLayer:
    """A transposed convolution of stride 2: twice as many cells along a side, 30 at most.

    Attributes:
        weight: (C, D, 4, 4): what a cell's C channels add to the D channels of finer cells.
        bias: (D,), or (side, side, D) where every cell has its own.
    """

    weight: Float32Array
    bias: Float32Array

    def __call__(self, values: Float32Array) -> Float32Array:
        """Map images (N, S, S, C), also given as (N, S * S * C), to (N, T, T, D)."""
        inputs, outputs = self.weight.shape[:2]
        side = round((values[0].size / inputs) ** 0.5)
        spread = values.reshape(-1, inputs) @ self.weight.transpose(0, 2, 3, 1).reshape(inputs, -1)
        spread = spread.reshape(len(values), side, side, KERNEL, KERNEL, outputs)
        whole = 2 * side + 2
        image = np.zeros((len(values), whole, whole, outputs), dtype=np.float32)
        for y in range(KERNEL):
            for x in range(KERNEL):
                image[:, y : y + 2 * side : 2, x : x + 2 * side : 2] += spread[:, :, :, y, x]
        margin = upsampling_padding(side)
        return image[:, margin : whole - margin, margin : whole - margin] + self.bias


def upsampling_padding(side: int) -> int:
    """Cells cut off each edge of what an image of some side spreads to."""
    return (2 * side + 2 - min(2 * side, ENVIRONMENT_CELLS)) // 2


@dataclass(frozen=True, slots=True, kw_only=True)
class GeneratorNetwork:
    """G(z): noise to environments; fitted, it is a `FittedSynthesizer`.

    Attributes:
        layers: With a leaky ReLU between them; the last one gives 900 values.
        leaky_slope: Negative slope of the leaky ReLUs.
    """

    layers: tuple[DenseLayer | UpsamplingLayer, ...]
    leaky_slope: float

    @property
    def is_endless(self) -> bool:
        """Every draw is from new noise."""
        return True

    def sample(
        self,
        count: int,
        *,
        rng: Generator,
        radius: float | None = None,  # noqa: ARG002  (the seam's: the caller sees to it)
    ) -> BoolArray:
        """Draw noise from N(0, 1) and binarize what comes out at a threshold of 0."""
        latent_size = self.layers[0].weight.shape[0]
        noise = rng.standard_normal((count, latent_size), dtype=np.float32)
        side = ENVIRONMENT_CELLS
        cells = np.empty((count, side, side), dtype=np.bool_)
        for first in range(0, count, SAMPLES_AT_ONCE):
            values = self.values(noise[first : first + SAMPLES_AT_ONCE])
            cells[first : first + len(values)] = (values > 0.0).reshape(-1, side, side)
        return cells

    def values(self, noise: Float32Array) -> Float32Array:
        """Map noise (N, latent) to what comes before the tanh: (N, 900), of the same sign."""
        values = noise
        for layer in self.layers[:-1]:
            values = layer(values)
            values = np.where(values > 0.0, values, np.float32(self.leaky_slope) * values)
        return self.layers[-1](values).reshape(len(noise), -1)

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """Give what rebuilds it."""
        arrays: dict[str, NDArray[np.generic]] = {"leaky_slope": np.array(self.leaky_slope)}
        for number, layer in enumerate(self.layers):
            arrays[f"layer{number}_weight"] = layer.weight
            arrays[f"layer{number}_bias"] = layer.bias
        return arrays


def network_from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> GeneratorNetwork:
    """Rebuild a network from its `arrays()`.

    Raises:
        KeyError: An array is missing.
    """
    count = sum(name.startswith("layer") and name.endswith("_weight") for name in arrays)
    return GeneratorNetwork(
        layers=tuple(
            _layer(arrays[f"layer{number}_weight"], arrays[f"layer{number}_bias"])
            for number in range(max(count, 1))
        ),
        leaky_slope=float(np.asarray(arrays["leaky_slope"], dtype=np.float64)),
    )


def _layer(weight: NDArray[np.generic], bias: NDArray[np.generic]) -> DenseLayer | UpsamplingLayer:
    kind = DenseLayer if weight.ndim == 2 else UpsamplingLayer
    return kind(
        weight=np.asarray(weight, dtype=np.float32), bias=np.asarray(bias, dtype=np.float32)
    )
