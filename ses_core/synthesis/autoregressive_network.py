"""The network behind `autoregressive`, in numpy alone: drawing needs no torch.

An environment is drawn row by row from its start edge to its goal edge, each row from left to
right. Whether a cell is occupied depends on the cells drawn before it in a window around it:

    a = relu(window @ window_weight + by_row[row] + by_column[column])
    b = a + relu(a @ hidden_weight + hidden_bias)
    p = sigmoid((b @ output_weight + output_by_row[row] + output_by_column[column]) / temperature)

The window's weights are shared by all cells; what is special to a place (near the start it is
free) is learned by row and by column, for each cell alone it would be learned by heart. The
chance of an environment is the product over its cells, and that is what the fit makes as great
as it can be: no discriminator, nothing to collapse.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.random import Generator
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ses_core.arrays import BoolArray, Float32Array
from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.synthesis.open_way import OpenWay

Sign = TypeVar("Sign", np.float32, np.int8)

SAMPLES_AT_ONCE = 256
"""Bounds the memory of a draw: the windows of one row of a batch take some 10 MB."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AutoregressiveNetwork:
    """Chances of a cell given those before it; fitted, it is a `FittedSynthesizer`.

    Attributes:
        window_weight: (W, H), the window as `causal_windows` lays it out.
        by_row: (30, H) added by a cell's row, start edge first.
        by_column: (30, H) added by a cell's column.
        hidden_weight: (H, H).
        hidden_bias: (H,).
        output_weight: (H,).
        output_by_row: (30,) added by a cell's row, start edge first.
        output_by_column: (30,) added by a cell's column.
        reach: Rows before the cell, and columns to either side, that its window holds.
        temperature: Logits are divided by this: below 1 what is likely becomes likelier.
        keeps_way_open: A cell that would close the last way stays free.
    """

    window_weight: Float32Array
    by_row: Float32Array
    by_column: Float32Array
    hidden_weight: Float32Array
    hidden_bias: Float32Array
    output_weight: Float32Array
    output_by_row: Float32Array
    output_by_column: Float32Array
    reach: int
    temperature: float
    keeps_way_open: bool

    @property
    def is_endless(self) -> bool:
        """Every draw is from new chances."""
        return True

    def sample(self, count: int, *, rng: Generator, radius: float | None = None) -> BoolArray:
        """Draw environments, those of a batch side by side; see `FittedSynthesizer`."""
        side = ENVIRONMENT_CELLS
        cells = np.empty((count, side, side), dtype=np.bool_)
        # Products this small are slower on several threads, many times so on a busy machine.
        with threadpool_limits(1):
            for first in range(0, count, SAMPLES_AT_ONCE):
                size = min(SAMPLES_AT_ONCE, count - first)
                drawn = self._draw(rng.random((size, side, side), dtype=np.float32), radius)
                cells[first : first + size] = drawn[:, ::-1]
        return cells

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        """Give what rebuilds it."""
        return {
            "window_weight": self.window_weight,
            "by_row": self.by_row,
            "by_column": self.by_column,
            "hidden_weight": self.hidden_weight,
            "hidden_bias": self.hidden_bias,
            "output_weight": self.output_weight,
            "output_by_row": self.output_by_row,
            "output_by_column": self.output_by_column,
            "reach": np.array(self.reach),
            "temperature": np.array(self.temperature),
            "keeps_way_open": np.array(self.keeps_way_open),
        }

    def _draw(self, uniform: Float32Array, radius: float | None) -> BoolArray:
        """Turn uniform numbers (N, 30, 30) into cells (N, 30, 30), start edge first."""
        size, side, _ = uniform.shape
        reach, before = self.reach, len(self.window_weight) - self.reach
        signs = padded_signs(np.zeros((size, side, side), dtype=np.bool_), reach)
        signs[:, reach:, reach:-reach] = 0.0
        way = OpenWay(size, radius=radius) if self.keeps_way_open and radius else None
        threshold = self.temperature * _logit(uniform)
        for row in range(side):
            # All that comes from earlier rows, for the whole row in one product.
            above = sliding_window_view(signs[:, row : row + reach], 2 * reach + 1, axis=2)
            rows = np.ascontiguousarray(above.transpose(0, 2, 1, 3)).reshape(size * side, before)
            known = (rows @ self.window_weight[:before]).reshape(size, side, -1)
            known += self.by_row[row] + self.by_column
            for column in range(side):
                left = signs[:, row + reach, column : column + reach]
                logits = self._logits(known[:, column] + left @ self.window_weight[before:])
                logits += self.output_by_row[row] + self.output_by_column[column]
                is_occupied = logits > threshold[:, row, column]
                if way is not None:
                    is_occupied = way.occupy(row, column, is_occupied)
                signs[:, row + reach, column + reach] = np.where(is_occupied, 1.0, -1.0)
        drawn: BoolArray = signs[:, reach:, reach:-reach] > 0.0
        return drawn

    def _logits(self, values: Float32Array) -> Float32Array:
        """Map sums (N, H) of the first layer to logits (N,), less what the place adds."""
        first = np.maximum(values, 0.0)
        second = np.maximum(first @ self.hidden_weight + self.hidden_bias, 0.0)
        logits: Float32Array = (first + second) @ self.output_weight
        return logits


def padded_signs(cells: BoolArray, reach: int) -> Float32Array:
    """Give cells (N, 30, 30), start edge first, as +1 and -1 (N, 30 + R, 30 + 2 R).

    Around them, before the start edge and beside both sides, lies 0: neither.
    """
    size, side, _ = cells.shape
    signs = np.zeros((size, side + reach, side + 2 * reach), dtype=np.float32)
    signs[:, reach:, reach:-reach] = np.where(cells, np.float32(1.0), np.float32(-1.0))
    return signs


def causal_windows(signs: NDArray[Sign], reach: int) -> NDArray[Sign]:
    """View the windows of padded signs (N, 30 + R, 30 + 2 R): (N, 30, 30, R + 1, 2 R + 1).

    Flattened, the first R (2 R + 1) + R values of one are what its cell is drawn from: R rows
    before it, then R cells to its left. The next value is the cell itself.
    """
    return sliding_window_view(signs, (reach + 1, 2 * reach + 1), axis=(1, 2))


def window_size(reach: int) -> int:
    """Number of cells before a cell in its window."""
    return reach * (2 * reach + 1) + reach


def autoregressive_from_arrays(arrays: Mapping[str, NDArray[np.generic]]) -> AutoregressiveNetwork:
    """Rebuild a network from its `arrays()`.

    Raises:
        KeyError: An array is missing.
    """
    weights = {
        name: np.asarray(arrays[name], dtype=np.float32)
        for name in (
            "window_weight",
            "by_row",
            "by_column",
            "hidden_weight",
            "hidden_bias",
            "output_weight",
            "output_by_row",
            "output_by_column",
        )
    }
    return AutoregressiveNetwork(
        **weights,
        reach=int(np.asarray(arrays["reach"], dtype=np.int64)),
        temperature=float(np.asarray(arrays["temperature"], dtype=np.float64)),
        keeps_way_open=bool(np.asarray(arrays["keeps_way_open"], dtype=np.bool_)),
    )


def _logit(chances: Float32Array) -> Float32Array:
    """Give log(p / (1 - p)); a logit above that of a uniform number has come true."""
    with np.errstate(divide="ignore"):
        logits: Float32Array = np.log(chances) - np.log1p(-chances)
    return logits
