"""The generators of `gan` and `gan-paper` after training, in numpy alone: drawing needs no torch.

A layer is fully connected or doubles the side of an image. Batch normalization by running
statistics is folded into its weights, since nothing lies between the two.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy import ndimage

from ses_core.arrays import BoolArray, Float32Array
from ses_core.occupancy import ENVIRONMENT_CELLS

SAMPLES_AT_ONCE = 64
"""What lies between two layers stays in the cache; more at once take longer each."""

KERNEL = 4
"""Side [cells] of an upsampling layer's kernel: each cell spreads over 4 x 4 finer ones."""

_TOUCHING = np.zeros((3, 3, 3), dtype=np.int64)
_TOUCHING[1] = 1
"""Neighbours of a cell: the eight around it, none in the environments before and after."""


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
        padded = np.pad(values.reshape(-1, side, side, inputs), ((0, 0), (1, 1), (1, 1), (0, 0)))
        # Of a kernel of 4 and a stride of 2, every finer cell gets its share from 2 x 2 coarse
        # ones: one product gives the 2 x 2 finer cells between them.
        windows = np.concatenate(
            [padded[:, 1 - y : side + 2 - y, 1 - x : side + 2 - x] for y in (0, 1) for x in (0, 1)],
            axis=-1,
        )
        kernel = self.weight.reshape(inputs, outputs, 2, 2, 2, 2).transpose(2, 4, 0, 3, 5, 1)
        spread = windows.reshape(-1, 4 * inputs) @ kernel.reshape(4 * inputs, 4 * outputs)
        spread = spread.reshape(-1, side + 1, side + 1, 2, 2, outputs).transpose(0, 1, 3, 2, 4, 5)
        whole = 2 * side + 2
        image = spread.reshape(-1, whole, whole, outputs)
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
        least_obstacle: Obstacles of fewer cells are left out of what is drawn.
    """

    layers: tuple[DenseLayer | UpsamplingLayer, ...]
    leaky_slope: float
    least_obstacle: int = 1

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
        """Draw noise from N(0, 1), binarize what comes out at 0, and leave out the specks."""
        latent_size = self.layers[0].weight.shape[0]
        noise = rng.standard_normal((count, latent_size), dtype=np.float32)
        side = ENVIRONMENT_CELLS
        cells = np.empty((count, side, side), dtype=np.bool_)
        for first in range(0, count, SAMPLES_AT_ONCE):
            values = self.values(noise[first : first + SAMPLES_AT_ONCE])
            cells[first : first + len(values)] = (values > 0.0).reshape(-1, side, side)
        return without_specks(cells, least=self.least_obstacle)

    def values(self, noise: Float32Array) -> Float32Array:
        """Map noise (N, latent) to what comes before the tanh: (N, 900), of the same sign."""
        values = noise
        for layer in self.layers[:-1]:
            values = layer(values)
            values = np.where(values > 0.0, values, np.float32(self.leaky_slope) * values)
        values = self.layers[-1](values)
        if values.ndim == 4 and values.shape[-1] > 1:
            values = np.minimum(values[..., ::2], values[..., 1::2]).max(axis=-1)
        return values.reshape(len(noise), -1)

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """Give what rebuilds it."""
        arrays: dict[str, NDArray[np.generic]] = {
            "leaky_slope": np.array(self.leaky_slope),
            "least_obstacle": np.array(self.least_obstacle),
        }
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
        least_obstacle=int(np.asarray(arrays["least_obstacle"], dtype=np.int64)),
    )


def without_specks(cells: BoolArray, *, least: int) -> BoolArray:
    """Clear the obstacles of environments (N, 30, 30) that have fewer than `least` cells.

    Cells that touch at a corner belong together, as where the scorecard counts obstacles.
    """
    if least <= 1:
        return cells
    labels, _ = ndimage.label(cells, _TOUCHING)
    is_kept = np.bincount(labels.reshape(-1)) >= least
    is_kept[0] = False
    kept: BoolArray = is_kept[labels]
    return kept


def _layer(weight: NDArray[np.generic], bias: NDArray[np.generic]) -> DenseLayer | UpsamplingLayer:
    kind = DenseLayer if weight.ndim == 2 else UpsamplingLayer
    return kind(
        weight=np.asarray(weight, dtype=np.float32), bias=np.asarray(bias, dtype=np.float32)
    )
