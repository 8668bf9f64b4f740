"""The search for the global plan against the fixed point of NavFn's interpolation."""

from dataclasses import replace

import numpy as np
import pytest

from ses_core.arrays import FloatArray
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask
from ses_core.planning.costmap import INSCRIBED, LETHAL, RESOLUTION_M
from ses_core.planning.parameters import DWA_SLOW
from ses_core.planning.potential import (
    COST_FACTOR,
    HIGHEST_COST,
    NEUTRAL_COST,
    UNREACHED,
)
from ses_core.settings import SimulationSettings
from ses_core.simulation.batch import BatchSimulator
from tests.simulated import Kernel, course, get, hall, kernel, parameters, simulator

KNOWN = SimulationSettings(imperfections="clean", known_map=True, sensing_rate_hz=20.0)


def cluttered(seed: int) -> NavigationTask:
    """A hall with blocks, its ends free."""
    rng = np.random.default_rng(seed)
    cells = hall(length=6.0, width=4.0)
    for row, column in zip(rng.integers(1, 36, 9), rng.integers(14, 44, 9), strict=True):
        cells[row : row + 4, column : column + 3] = True
    return course(cells, start=Pose2D(0.8, 2.0, 0.0), goal=(5.3, 2.0))


def searched(driven: BatchSimulator, inflation_radius: float = 0.3) -> Kernel:
    """Search from where the robot is: costs of another inflation radius force it."""
    chosen = replace(DWA_SLOW, inflation_radius=inflation_radius)
    driven.plan_commands(parameters(driven.slots, chosen))
    return kernel(driven)


def entering_costs(k: Kernel) -> FloatArray:
    """Cost (H, W) of entering a cell, inf where it is barred."""
    height, width = int(get(k.slot, "map_height")), int(get(k.slot, "map_width"))
    squared = k.memory.distances[: height * width].reshape(height, width)
    costs = k.memory.costs[0][squared].astype(np.float64)
    entering = np.minimum(NEUTRAL_COST + COST_FACTOR * costs, HIGHEST_COST)
    start_row, start_column = divmod(start_cell(k), width)
    rows, columns = np.indices(costs.shape)
    is_near = (rows - start_row) ** 2 + (columns - start_column) ** 2 <= 49
    entering[costs >= INSCRIBED] = np.inf
    entering[(costs >= INSCRIBED) & (costs < LETHAL) & is_near] = HIGHEST_COST
    entering[[0, -1], :] = np.inf
    entering[:, [0, -1]] = np.inf
    return entering


def start_cell(k: Kernel) -> int:
    column, row = (
        int((get(k.slot, axis) - get(k.slot, f"map_{axis}")) / RESOLUTION_M) for axis in "xy"
    )
    return row * int(get(k.slot, "map_width")) + column


def fixed_point(entering: FloatArray, goal: tuple[int, int]) -> FloatArray:
    """Lower every cell by its neighbours until none gets lower any more."""
    potential = np.full(entering.shape, np.inf)
    potential[goal] = 0.0
    with np.errstate(invalid="ignore"):
        while True:
            padded = np.pad(potential, 1, constant_values=np.inf)
            across = np.minimum(padded[1:-1, :-2], padded[1:-1, 2:])
            along = np.minimum(padded[:-2, 1:-1], padded[2:, 1:-1])
            low, high = np.minimum(across, along), np.maximum(across, along)
            share = (high - low) / entering
            smooth = low + entering * (-0.2301 * share**2 + 0.5307 * share + 0.7040)
            value = np.where(high - low >= entering, low + entering, smooth)
            value[~np.isfinite(low) | ~np.isfinite(entering)] = np.inf
            lower = np.minimum(potential, value)
            if np.array_equal(lower, potential):
                return potential
            potential = lower


@pytest.mark.parametrize("seed", range(6))
def test_searches_one_after_another_come_to_the_fixed_point(seed: int) -> None:
    driven = simulator(cluttered(seed), cluttered(seed + 100), settings=KNOWN)
    # The second time the robot is elsewhere, and what the first search has left is in the way.
    for inflation_radius in (0.3, 0.25):
        k = searched(driven, inflation_radius)
        height, width = int(get(k.slot, "map_height")), int(get(k.slot, "map_width"))
        found = k.memory.potential[: height * width].reshape(height, width)
        goal = divmod(int(np.flatnonzero(found.ravel() == 0.0)[0]), width)
        expected = fixed_point(entering_costs(k), (goal[0], goal[1]))
        start = divmod(start_cell(k), width)
        assert found[start] < UNREACHED
        assert found[start] == pytest.approx(expected[start], rel=0.01)
        is_reached = found < UNREACHED
        assert np.all(found[is_reached] >= expected[is_reached] - 0.5)
        assert not k.scratch.bucket_of.any()
        assert np.all(k.scratch.bucket_ends == -1)
        rows, columns = np.nonzero(is_reached)
        assert get(k.slot, "reached_left") <= columns.min()
        assert columns.max() <= get(k.slot, "reached_right")
        assert get(k.slot, "reached_bottom") <= rows.min()
        assert rows.max() <= get(k.slot, "reached_top")
        driven.advance(parameters(2), 60)


def test_without_a_way_the_search_rests_for_a_tick_and_the_last_plan_stays() -> None:
    cells = hall()
    driven = simulator(course(cells), settings=KNOWN)
    k = searched(driven)
    plan_size, searched_at = get(k.slot, "plan_size"), []
    k.memory.marks[:] = 0
    k.memory.distances[:] = 255
    width, height = int(get(k.slot, "map_width")), int(get(k.slot, "map_height"))
    column = int((4.0 - get(k.slot, "map_x")) / RESOLUTION_M)
    k.memory.marks[: width * height].reshape(height, width)[:, column] = 1
    k.memory.distances[: width * height].reshape(height, width)[:, column - 1 : column + 2] = 0
    for _ in range(6):
        driven.advance(parameters(1), 1)
        searched_at.append(int(get(k.slot, "search_tick")))
    assert get(k.slot, "search_needed")
    assert get(k.slot, "plan_size") >= plan_size - 5
    # Every other tick of 20 Hz, whichever is the first.
    assert np.diff(np.unique(searched_at)).tolist() in ([2, 2], [2, 2, 2])
