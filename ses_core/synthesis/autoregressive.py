"""`autoregressive`, fitted with torch: the network under which the recorded places are likeliest.

Every cell of every environment, and of its mirror image, is an example: the cells before it, and
whether it is occupied. Most cells are free like those before them and teach nothing, so a batch
holds few of these, and each counts for more. Adam descends the code length under a learning
rate that falls like a cosine; a running average of the weights is kept.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.random import Generator
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from ses_core.arrays import BoolArray, Float32Array, IntArray
from ses_core.navigation import NavigationDomain
from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.protocols import FittedSynthesizer
from ses_core.synthesis.autoregressive_network import (
    AutoregressiveNetwork,
    causal_windows,
    padded_signs,
    window_size,
)
from ses_core.synthesis.seeded_torch import one_seeded_thread
from ses_core.synthesis_settings import AutoregressiveSettings

_WARM_UP = 100
"""Updates over which the learning rate rises."""


@dataclass(frozen=True, slots=True)
class Autoregressive:
    """Learns the chance of each cell given those before it."""

    settings: AutoregressiveSettings

    def fit(
        self,
        domain: NavigationDomain,
        *,
        rng: Generator,
        progress: Callable[[float], None],
        start: FittedSynthesizer | None = None,
    ) -> AutoregressiveNetwork:
        """Train on the environments and their mirror images; equal seeds give equal weights.

        A `start` of other sizes is begun without. Leaves torch's random state and thread count
        as they were.
        """
        examples = Examples.of(domain.cells(), reach=self.settings.reach)
        with one_seeded_thread(int(rng.integers(2**63))):
            network = CausalNetwork(self.settings)
            if isinstance(start, AutoregressiveNetwork):
                network.begin_with(start)
            kept = _train(network, examples, self.settings, rng, progress)
        return AutoregressiveNetwork(
            **kept,
            reach=self.settings.reach,
            temperature=self.settings.temperature,
            keeps_way_open=self.settings.keeps_way_open,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Examples:
    """Cells to learn from, those of the environments and of their mirror images.

    Attributes:
        windows: (2 N, 30, 30, R + 1, 2 R + 1) view of `causal_windows`, a byte a cell.
        telling: (T,) flat indices of the cells with something other among those before them.
        plain: (P,) flat indices of all others.
    """

    windows: NDArray[np.int8]
    telling: IntArray
    plain: IntArray

    @classmethod
    def of(cls, cells: BoolArray, *, reach: int) -> "Examples":
        """Prepare environments (N, 30, 30)."""
        from_start = cells[:, ::-1]
        both = np.concatenate((from_start, from_start[:, :, ::-1]))
        is_telling = _is_telling(both).ravel()
        return cls(
            windows=causal_windows(padded_signs(both, reach).astype(np.int8), reach),
            telling=np.flatnonzero(is_telling),
            plain=np.flatnonzero(~is_telling),
        )

    def draw(self, size: int, plain_share: float, rng: Generator) -> tuple[Tensor, ...]:
        """Draw a batch: windows (B, W), rows, columns, occupied or not, and weights (B,)."""
        plain = min(max(round(plain_share * size), 1), size - 1)
        if not (len(self.telling) and len(self.plain)):
            plain = size if len(self.plain) else 0
        total = len(self.telling) + len(self.plain)
        parts: list[IntArray] = []
        weights = np.empty(size, dtype=np.float32)
        telling = size - plain
        for pool, share in ((self.telling, slice(0, telling)), (self.plain, slice(telling, size))):
            drawn = share.stop - share.start
            if drawn:
                parts.append(pool[rng.integers(len(pool), size=drawn)])
                weights[share] = len(pool) / total * size / drawn
        chosen = np.concatenate(parts)
        image, place = np.divmod(chosen, ENVIRONMENT_CELLS**2)
        row, column = np.divmod(place, ENVIRONMENT_CELLS)
        flat = self.windows[image, row, column].reshape(size, -1)
        inputs = window_size(self.windows.shape[3] - 1)
        return (
            torch.from_numpy(flat[:, :inputs].astype(np.float32)),
            torch.from_numpy(row),
            torch.from_numpy(column),
            torch.from_numpy((flat[:, inputs] > 0).astype(np.float32)),
            torch.from_numpy(weights),
        )


def _is_telling(cells: BoolArray) -> BoolArray:
    """Tell which cells (N, 30, 30) are not all alike with the twelve nearest before them."""
    padded = np.pad(cells, ((0, 0), (2, 0), (2, 2)))
    size = ENVIRONMENT_CELLS
    nearby = np.zeros_like(cells, dtype=np.uint8)
    for down in range(3):
        for right in range(5):
            if down < 2 or right <= 2:
                nearby += padded[:, down : down + size, right : right + size]
    return (nearby > 0) & (nearby < 13)


class CausalNetwork(nn.Module):
    """`AutoregressiveNetwork`, as torch trains it."""

    def __init__(self, settings: AutoregressiveSettings) -> None:
        super().__init__()
        inputs, hidden = window_size(settings.reach), settings.hidden
        side = ENVIRONMENT_CELLS
        self.window_weight = nn.Parameter(torch.randn(inputs, hidden) * math.sqrt(2.0 / inputs))
        self.by_row = nn.Parameter(torch.zeros(side, hidden))
        self.by_column = nn.Parameter(torch.zeros(side, hidden))
        self.hidden_weight = nn.Parameter(torch.randn(hidden, hidden) * math.sqrt(2.0 / hidden))
        self.hidden_bias = nn.Parameter(torch.zeros(hidden))
        self.output_weight = nn.Parameter(torch.zeros(hidden))
        self.output_by_row = nn.Parameter(torch.zeros(side))
        self.output_by_column = nn.Parameter(torch.zeros(side))
        self._dropout = settings.dropout

    def forward(self, windows: Tensor, rows: Tensor, columns: Tensor) -> Tensor:
        """Map windows (B, W) of cells in rows (B,) and columns (B,) to logits (B,)."""
        place = self.by_row[rows] + self.by_column[columns]
        first = self._dropped(functional.relu(windows @ self.window_weight + place))
        second = functional.relu(first @ self.hidden_weight + self.hidden_bias)
        place_output = self.output_by_row[rows] + self.output_by_column[columns]
        return (first + self._dropped(second)) @ self.output_weight + place_output

    def _dropped(self, values: Tensor) -> Tensor:
        return functional.dropout(values, self._dropout, training=self.training)

    def begin_with(self, start: AutoregressiveNetwork) -> None:
        """Take over the weights of an earlier fit, if it has the same sizes."""
        weights = {name: getattr(start, name) for name, _ in self.named_parameters()}
        if all(weights[name].shape == tuple(own.shape) for name, own in self.named_parameters()):
            self.load_state_dict({name: torch.from_numpy(value) for name, value in weights.items()})


def _train(
    network: CausalNetwork,
    examples: Examples,
    settings: AutoregressiveSettings,
    rng: Generator,
    progress: Callable[[float], None],
) -> dict[str, Float32Array]:
    """Run the updates and give the average weights by name."""
    optimiser = torch.optim.AdamW(
        network.parameters(), lr=0.0, weight_decay=settings.weight_decay, fused=True
    )
    averages = [weight.detach().clone() for weight in network.parameters()]
    for update in range(settings.updates):
        share = update / settings.updates
        rate = settings.learning_rate * 0.5 * (1.0 + math.cos(math.pi * share))
        optimiser.param_groups[0]["lr"] = rate * min(1.0, (update + 1) / _WARM_UP)
        windows, rows, columns, targets, weights = examples.draw(
            settings.batch_size, settings.plain_share, rng
        )
        loss = functional.binary_cross_entropy_with_logits(
            network(windows, rows, columns), targets, weight=weights
        )
        optimiser.zero_grad(set_to_none=True)
        torch.autograd.backward(loss)
        optimiser.step()
        # An average that begins with the first weights would keep them in for long.
        decay = min(settings.averaging, (update + 1) / (update + 10))
        with torch.no_grad():
            torch._foreach_lerp_(averages, list(network.parameters()), 1.0 - decay)
        if (update + 1) % 20 == 0:
            progress((update + 1) / settings.updates)
    progress(1.0)
    return {
        name: np.ascontiguousarray(value.numpy(), dtype=np.float32)
        for (name, _), value in zip(network.named_parameters(), averages, strict=True)
    }
