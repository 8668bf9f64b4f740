"""The least a training update can cost: its matrix products, done by torch and nothing else.

Shapes and counts are taken from the networks themselves. A convolution is the product it would
be over its unfolded images, and is spared the unfolding.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor, nn

Shape = tuple[int, int, int]
"""(rows, summed over, columns) of a matrix product."""

Pass = Literal["forward", "weights", "inputs", "all but first inputs"]
"""Over a batch: a network's outputs, the gradients of its weights, those of its inputs."""


@dataclass(frozen=True)
class Floor:
    """Products of one update."""

    shapes: Sequence[Shape]

    @property
    def operations(self) -> int:
        """Multiplications and additions."""
        return sum(2 * rows * inner * columns for rows, inner, columns in self.shapes)

    def seconds(self, updates: int) -> float:
        """Do the products of so many updates, on this thread, and give the CPU time [s]."""
        pairs = [
            (torch.randn(rows, inner), torch.randn(inner, columns), torch.empty(rows, columns))
            for rows, inner, columns in self.shapes
        ]
        begun = time.process_time()
        for _ in range(updates):
            for first, second, product in pairs:
                torch.mm(first, second, out=product)
        return time.process_time() - begun


def products(network: nn.Sequential, example: Tensor, passes: Sequence[Pass]) -> list[Shape]:
    """List the products of some passes of a network over a batch like `example`."""
    shapes: list[Shape] = []
    is_first = True
    for module, inputs, outputs in _weighted(network, example):
        rows, inner, columns = _shape(module, inputs, outputs)
        if "forward" in passes:
            shapes.append((rows, inner, columns))
        if "weights" in passes:
            shapes.append((inner, rows, columns))
        if "inputs" in passes or ("all but first inputs" in passes and not is_first):
            shapes.append((rows, columns, inner))
        is_first = False
    return shapes


def _weighted(
    network: nn.Sequential, example: Tensor
) -> list[tuple[nn.Module, Sequence[int], Sequence[int]]]:
    """Run a network, and give its layers with weights with the shapes they took and gave."""
    found: list[tuple[nn.Module, Sequence[int], Sequence[int]]] = []
    values = example
    with torch.no_grad():
        for module in network:
            before = values.shape
            values = module(values)
            if isinstance(module, nn.Linear | nn.Conv2d | nn.ConvTranspose2d):
                found.append((module, before, values.shape))
    return found


def _shape(module: nn.Module, inputs: Sequence[int], outputs: Sequence[int]) -> Shape:
    if isinstance(module, nn.Conv2d):
        window = math.prod(module.kernel_size)
        return outputs[0] * outputs[2] * outputs[3], inputs[1] * window, outputs[1]
    if isinstance(module, nn.ConvTranspose2d):
        window = math.prod(module.kernel_size)
        return inputs[0] * inputs[2] * inputs[3], inputs[1], outputs[1] * window
    return inputs[0], inputs[1], outputs[1]
