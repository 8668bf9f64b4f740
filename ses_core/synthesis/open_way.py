"""Keeping a way open while an environment is drawn cell by cell.

`ses_core.synthesis.traversability` decides by chains: squares less than a disc's diameter apart
let no disc between them, and the disc is kept from the goal if and only if a chain leads from
the left side to the right one, or a square is too near to the start or the goal. So a cell may
be occupied as long as it joins no chain of the left side with one of the right, and what can be
crossed once all cells are drawn is decided as they are drawn. Chains are sets of squares,
joined as squares come in (union by root, with paths halved).
"""

import math

import numpy as np

from ses_core.arrays import BoolArray, IntArray
from ses_core.compilation import compiled
from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.synthesis.traversability import radius_in_cells

_CELLS = ENVIRONMENT_CELLS**2
_LEFT, _RIGHT = _CELLS, _CELLS + 1  # the sides, as members of chains


class OpenWay:
    """Keeps N environments open for a disc of a radius [m] while their cells are drawn.

    Which edge is drawn first does not matter: start and goal lie on the middles of both.
    """

    def __init__(self, count: int, *, radius: float) -> None:
        """Begin with nothing occupied.

        Raises:
            ValueError: The radius is out of range.
        """
        self._radius = radius_in_cells(radius)
        self._chains = np.tile(np.arange(_CELLS + 2), (count, 1))
        self._cells = np.zeros((count, ENVIRONMENT_CELLS, ENVIRONMENT_CELLS), dtype=np.bool_)

    def occupy(self, row: int, column: int, wanted: BoolArray) -> BoolArray:
        """Occupy a cell where that is wanted (N,) and leaves a way; tells where it was done."""
        done = wanted.copy()
        _occupy(self._cells, self._chains, row, column, self._radius, done)
        return done


@compiled
def _occupy(
    cells: BoolArray, chains: IntArray, row: int, column: int, radius: float, done: BoolArray
) -> None:
    size = cells.shape[1]
    across = max(abs(column + 0.5 - size / 2) - 0.5, 0.0)
    is_end = math.hypot(across, min(row, size - 1 - row)) < radius
    for number in range(cells.shape[0]):
        if not done[number]:
            continue
        done[number] = not is_end and _join(cells[number], chains[number], row, column, radius)
        cells[number, row, column] = done[number]


@compiled
def _join(cells: BoolArray, chains: IntArray, row: int, column: int, radius: float) -> bool:
    """Join a square with all chains it touches, unless it would join both sides."""
    size = cells.shape[0]
    reach = math.floor(2.0 * radius) + 1
    found = np.empty((2 * reach + 1) ** 2 + 3, dtype=np.int64)
    found[0] = _root(chains, row * size + column)
    count = 1
    if column < 2.0 * radius:
        found[count] = _root(chains, _LEFT)
        count += 1
    if size - 1 - column < 2.0 * radius:
        found[count] = _root(chains, _RIGHT)
        count += 1
    for r in range(max(row - reach, 0), min(row + reach + 1, size)):
        for c in range(max(column - reach, 0), min(column + reach + 1, size)):
            if cells[r, c]:
                gap = math.hypot(max(abs(r - row) - 1, 0), max(abs(c - column) - 1, 0))
                if gap < 2.0 * radius:
                    found[count] = _root(chains, r * size + c)
                    count += 1
    left, right = _root(chains, _LEFT), _root(chains, _RIGHT)
    touches_left = touches_right = False
    for index in range(count):
        touches_left |= found[index] == left
        touches_right |= found[index] == right
    if touches_left and touches_right:
        return False
    for index in range(1, count):
        chains[_root(chains, found[index])] = _root(chains, found[0])
    return True


@compiled
def _root(chains: IntArray, member: int) -> int:
    while chains[member] != member:
        chains[member] = chains[chains[member]]
        member = chains[member]
    return member
