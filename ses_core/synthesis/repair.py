"""Make environments crossable by clearing as few occupied cells as possible.

An environment cannot be crossed where squares less than a diameter apart are chained from the
left side to the right one, or lie on the start or the goal (`traversability`). What lies on an
end has to go. Of the rest, enough has to go that no chain is left: a smallest vertex cut
between the sides in the graph whose edges join squares less than a diameter apart. By Menger's
theorem its size is the largest number of chains that share no square, and augmenting paths
find both (Ford and Fulkerson 1956). The number of cleared cells is therefore the least
possible, not an estimate of it.

Of several such cuts the one is taken that leaves room for the widest disc, up to
`RADIUS_LIMIT_M`; of these the one nearest to the line from start to goal, and of these the
one farthest to the left.
"""

from typing import NamedTuple

import numpy as np

from ses_core.arrays import BoolArray, IntArray
from ses_core.compilation import compiled_in_place
from ses_core.occupancy import ENVIRONMENT_CELLS, ENVIRONMENT_RESOLUTION_M
from ses_core.synthesis.traversability import RADIUS_LIMIT_M, check_stack, radius_in_cells

TOO_MANY = -1
"""Stands in the counts for an environment that would need more cleared cells than allowed."""

_REACH = round(2.0 * RADIUS_LIMIT_M / ENVIRONMENT_RESOLUTION_M)
"""Most cells from one square to another one that a disc of the widest radius cannot pass."""

_WIDTH = ENVIRONMENT_CELLS + 2 * _REACH
"""Columns of an environment with a free margin, so that neighbours need no check of bounds."""

_CELL = 1 << 15
"""What clearing a cell costs; more than the distances of all cells from the middle together."""

_UNLIMITED = 1 << 62
_UNSEEN, _FROM_SIDE = -1, -2


class _Network(NamedTuple):
    """The graph of an environment's squares, and a flow from its left to its right side.

    Attributes:
        steps: (K,) from a square to those that may be too near to it.
        gaps: (K,) between them, squared [cells²].
        occupied: (S,) which squares are there.
        capacity: (S,) what clearing a square costs: the most that can flow through it.
        through: (S,) what flows through it.
        flow: (S, K) from a square over each of its steps.
        parents: (2 S,) the node that a search came from.
        ways: (2 S,) the step that it came over.
        waiting: (2 S,) nodes that a search has reached and not yet gone on from.
    """

    steps: IntArray
    gaps: IntArray
    occupied: BoolArray
    capacity: IntArray
    through: IntArray
    flow: IntArray
    parents: IntArray
    ways: IntArray
    waiting: IntArray


def repair(cells: BoolArray, *, radius: float, most: int) -> tuple[BoolArray, IntArray]:
    """Clear the fewest occupied cells that let a disc cross.

    Args:
        cells: (N, 30, 30), True = occupied.
        radius: Of the disc [m].
        most: An environment that would need more cleared cells is left as it is.

    Returns:
        Cells (N, 30, 30), and how many were cleared (N,): 0 where the disc can cross already,
        `TOO_MANY` where the environment was left.

    Raises:
        ValueError: The cells are no stack of environments, or the radius is out of range.
    """
    radius_cells = radius_in_cells(radius)
    check_stack(cells)
    repaired = np.array(cells, dtype=np.bool_, order="C")
    cleared = np.zeros(len(cells), dtype=np.int64)
    net = _empty_network()
    # Squared gaps are whole numbers: a radius decides which is the largest that it closes.
    closed = int(np.ceil((2.0 * radius_cells) ** 2)) - 1
    levels = np.concatenate(([closed], np.unique(net.gaps[net.gaps > closed])))
    _repair_all(repaired, _ends(radius_cells), net, levels, most, cleared)
    return repaired, cleared


def _empty_network() -> _Network:
    """Lay out room for any environment.

    Steps count in an environment flattened with its margin. Those over the least gaps are first,
    and of equal ones those to the left: a search tries the last one first.
    """
    offsets = np.arange(-_REACH, _REACH + 1)
    between = np.maximum(np.abs(offsets) - 1, 0)
    gaps = between[:, None] ** 2 + between[None, :] ** 2
    steps = offsets[:, None] * _WIDTH + offsets[None, :]
    is_near = (gaps < _REACH**2) & (steps != 0)
    across = np.broadcast_to(offsets, steps.shape)[is_near]
    order = np.lexsort((across, gaps[is_near]))
    squares = _WIDTH * _WIDTH
    return _Network(
        steps=steps[is_near][order],
        gaps=gaps[is_near][order],
        occupied=np.zeros(squares, dtype=np.bool_),
        capacity=np.zeros(squares, dtype=np.int64),
        through=np.zeros(squares, dtype=np.int64),
        flow=np.zeros((squares, len(order)), dtype=np.int64),
        parents=np.empty(2 * squares, dtype=np.int64),
        ways=np.empty(2 * squares, dtype=np.int64),
        waiting=np.empty(2 * squares, dtype=np.int64),
    )


def _ends(radius_cells: float) -> BoolArray:
    """Mark the cells (30, 30) that the disc touches when it stands on the start or the goal."""
    numbers = np.arange(ENVIRONMENT_CELLS)
    across = np.maximum(np.abs(numbers + 0.5 - ENVIRONMENT_CELLS / 2) - 0.5, 0.0)
    along = np.minimum(numbers, ENVIRONMENT_CELLS - 1 - numbers)
    ends: BoolArray = np.hypot(along[:, None], across[None, :]) < radius_cells
    return ends


@compiled_in_place
def _repair_all(
    cells: BoolArray, ends: BoolArray, net: _Network, levels: IntArray, most: int, cleared: IntArray
) -> None:
    """Repair every environment in place; `levels` are the squared gaps to close, least first."""
    for index in range(len(cells)):
        needed = _lay_out(cells[index], ends, net)
        chains = 0
        while needed + chains <= most:
            last = _find_chain(net, levels[0])
            if last == _UNSEEN:
                break
            _saturate(net, last)
            chains += 1
        if needed + chains > most:
            cleared[index] = TOO_MANY
            continue
        cleared[index] = needed + chains
        if chains > 0:
            _choose_cut(net, levels)
        _clear(cells[index], ends, net, chains > 0)


@compiled_in_place
def _lay_out(cells: BoolArray, ends: BoolArray, net: _Network) -> int:
    """Begin with an environment's squares and no flow; give how many squares lie on the ends."""
    on_ends = 0
    for row in range(ENVIRONMENT_CELLS):
        for column in range(ENVIRONMENT_CELLS):
            square = (row + _REACH) * _WIDTH + column + _REACH
            is_in_the_way = cells[row, column] and ends[row, column]
            on_ends += is_in_the_way
            net.occupied[square] = cells[row, column] and not is_in_the_way
            net.capacity[square] = _CELL
            if net.through[square] > 0:
                net.through[square] = 0
                net.flow[square] = 0
    return on_ends


@compiled_in_place
def _find_chain(net: _Network, closed: int) -> int:
    """Search depth first for a way that more can flow on, from the left side to the right.

    Square s has an entry 2 s and an exit 2 s + 1; between them flows at most its capacity,
    between squares whose squared gap is at most `closed` any amount.

    Returns:
        The last exit on the way, or `_UNSEEN`; `net.parents` leads back from it.
    """
    near = np.searchsorted(net.gaps, closed, side="right")
    net.parents[:] = _UNSEEN
    count = 0
    for row in range(ENVIRONMENT_CELLS):
        for column in range(ENVIRONMENT_CELLS):
            square = (row + _REACH) * _WIDTH + column + _REACH
            if column * column <= closed and net.occupied[square]:
                net.parents[2 * square] = _FROM_SIDE
                net.waiting[count] = 2 * square
                count += 1
    while count > 0:
        count -= 1
        node = net.waiting[count]
        square, is_exit = node >> 1, node & 1
        # Through the square itself: onwards what is left of its capacity, back what flows.
        room = net.through[square] if is_exit else net.capacity[square] - net.through[square]
        if room > 0 and net.parents[node ^ 1] == _UNSEEN:
            net.parents[node ^ 1] = node
            net.waiting[count] = node ^ 1
            count += 1
        if is_exit:
            to_side = ENVIRONMENT_CELLS - 1 - (square % _WIDTH - _REACH)
            if to_side * to_side <= closed:
                return node
        elif net.through[square] == 0:
            continue
        for way in range(near):
            other = square + net.steps[way] if is_exit else square - net.steps[way]
            target = 2 * other + 1 - is_exit
            if not net.occupied[other] or net.parents[target] != _UNSEEN:
                continue
            if is_exit or net.flow[other, way] > 0:
                net.parents[target] = node
                net.ways[target] = way
                net.waiting[count] = target
                count += 1
    return _UNSEEN


@compiled_in_place
def _saturate(net: _Network, last: int) -> None:
    """Send as much as there is room for along the way that ends in an exit."""
    amount = _UNLIMITED
    node = last
    while net.parents[node] != _FROM_SIDE:
        before = net.parents[node]
        square = node >> 1
        if square == before >> 1:
            is_onwards = node & 1
            room = net.capacity[square] - net.through[square] if is_onwards else net.through[square]
            amount = min(amount, room)
        elif node & 1:
            amount = min(amount, net.flow[square, net.ways[node]])
        node = before
    node = last
    while net.parents[node] != _FROM_SIDE:
        before = net.parents[node]
        square = node >> 1
        if square == before >> 1:
            net.through[square] += amount if node & 1 else -amount
        elif node & 1:
            net.flow[square, net.ways[node]] -= amount
        else:
            net.flow[before >> 1, net.ways[node]] += amount
        node = before


@compiled_in_place
def _choose_cut(net: _Network, levels: IntArray) -> None:
    """Leave in `net.parents` what the left side reaches past the best of the smallest cuts."""
    level = 0
    while level + 1 < len(levels) and _find_chain(net, levels[level + 1]) == _UNSEEN:
        level += 1
    for row in range(ENVIRONMENT_CELLS):
        for column in range(ENVIRONMENT_CELLS):
            square = (row + _REACH) * _WIDTH + column + _REACH
            net.capacity[square] += abs(2 * column + 1 - ENVIRONMENT_CELLS)
    last = _find_chain(net, levels[level])
    while last != _UNSEEN:
        _saturate(net, last)
        last = _find_chain(net, levels[level])


@compiled_in_place
def _clear(cells: BoolArray, ends: BoolArray, net: _Network, has_cut: bool) -> None:
    """Clear what lies on the ends, and the squares that the left side reaches but not through."""
    for row in range(ENVIRONMENT_CELLS):
        for column in range(ENVIRONMENT_CELLS):
            entry = 2 * ((row + _REACH) * _WIDTH + column + _REACH)
            is_cut = net.parents[entry] != _UNSEEN and net.parents[entry + 1] == _UNSEEN
            if ends[row, column] or (has_cut and is_cut):
                cells[row, column] = False
