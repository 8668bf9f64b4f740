"""The generator of SES-GAN after training, in numpy alone: drawing needs no torch."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ses_core.arrays import BoolArray, Float32Array
from ses_core.occupancy import ENVIRONMENT_CELLS

SAMPLES_AT_ONCE = 1024
"""Bounds the memory of a forward pass to some megabytes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HiddenLayer:
    """Fully connected, with batch normalization by running statistics folded in.

    Attributes:
        weight: (inputs, outputs).
        bias: (outputs,).
        scale: (outputs,) of the batch normalization.
        shift: (outputs,) of the batch normalization.
    """

    weight: Float32Array
    bias: Float32Array
    scale: Float32Array
    shift: Float32Array


@dataclass(frozen=True, slots=True, kw_only=True)
class GeneratorNetwork:
    """G(z): noise to environments; fitted, it is a `FittedSynthesizer`.

    Attributes:
        hidden: Hidden layers.
        weight: (inputs, 900) of the output layer.
        bias: (900,) of the output layer.
        leaky_slope: Negative slope of the leaky ReLUs.
    """

    hidden: tuple[HiddenLayer, ...]
    weight: Float32Array
    bias: Float32Array
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
        latent_size = self.hidden[0].weight.shape[0]
        noise = rng.standard_normal((count, latent_size), dtype=np.float32)
        side = ENVIRONMENT_CELLS
        cells = np.empty((count, side, side), dtype=np.bool_)
        for first in range(0, count, SAMPLES_AT_ONCE):
            images = self.images(noise[first : first + SAMPLES_AT_ONCE])
            cells[first : first + len(images)] = (images > 0.0).reshape(-1, side, side)
        return cells

    def images(self, noise: Float32Array) -> Float32Array:
        """Map noise (N, latent) to images (N, 900) in (-1, 1)."""
        values = noise
        for layer in self.hidden:
            values = (values @ layer.weight + layer.bias) * layer.scale + layer.shift
            values = np.where(values > 0.0, values, np.float32(self.leaky_slope) * values)
        return np.tanh(values @ self.weight + self.bias)

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """Give what rebuilds it."""
        arrays: dict[str, NDArray[np.generic]] = {
            "output_weight": self.weight,
            "output_bias": self.bias,
            "leaky_slope": np.array(self.leaky_slope),
        }
        for number, layer in enumerate(self.hidden):
            arrays[f"hidden{number}_weight"] = layer.weight
            arrays[f"hidden{number}_bias"] = layer.bias
            arrays[f"hidden{number}_scale"] = layer.scale
            arrays[f"hidden{number}_shift"] = layer.shift
        return arrays


def network_from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> GeneratorNetwork:
    """Rebuild a network from its `arrays()`.

    Raises:
        KeyError: An array is missing.
    """
    hidden_count = sum(name.startswith("hidden") and name.endswith("_weight") for name in arrays)
    return GeneratorNetwork(
        hidden=tuple(
            HiddenLayer(
                weight=_float32(arrays[f"hidden{number}_weight"]),
                bias=_float32(arrays[f"hidden{number}_bias"]),
                scale=_float32(arrays[f"hidden{number}_scale"]),
                shift=_float32(arrays[f"hidden{number}_shift"]),
            )
            for number in range(hidden_count)
        ),
        weight=_float32(arrays["output_weight"]),
        bias=_float32(arrays["output_bias"]),
        leaky_slope=float(np.asarray(arrays["leaky_slope"], dtype=np.float64)),
    )


def _float32(array: NDArray[np.generic]) -> Float32Array:
    return np.asarray(array, dtype=np.float32)
