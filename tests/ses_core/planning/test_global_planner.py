"""The global plan and the shortest way."""

import math

import numpy as np
import pytest

from ses_core.geometry import Pose2D
from ses_core.occupancy import OccupancyGrid
from ses_core.planning.costmap import INSCRIBED, RESOLUTION_M
from ses_core.planning.global_planner import optimal_path_length
from ses_core.planning.parameters import DWA_SLOW
from tests.simulated import course, get, hall, kernel, parameters, planned, simulator


def test_the_plan_through_open_space_is_straight() -> None:
    driven = simulator(course(hall(), start=Pose2D(1.0, 1.5, 0.3), goal=(5.0, 3.3)))
    driven.plan_commands(parameters(1))
    plan = driven.plan(0)
    along = np.array([4.0, 1.8]) / math.hypot(4.0, 1.8)
    across = (plan - [1.0, 1.5]) @ np.array([-along[1], along[0]])
    assert np.abs(across).max() < 0.12
    np.testing.assert_allclose(plan[0], [1.0, 1.5], atol=1e-5)
    np.testing.assert_allclose(plan[-1], [5.0, 3.3], atol=0.08)


@pytest.mark.parametrize("goal", [(8.0, 2.5), (6.0, 4.0), (3.0, 4.0)])
def test_the_potential_is_50_per_cell_of_straight_distance_in_open_space(
    goal: tuple[float, float],
) -> None:
    k = planned(course(hall(), goal=goal))
    width = int(get(k.slot, "map_width"))
    row = int((2.5 - get(k.slot, "map_y")) / RESOLUTION_M)
    column = int((1.0 - get(k.slot, "map_x")) / RESOLUTION_M)
    expected = 50.0 * math.hypot(goal[0] - 1.0, goal[1] - 2.5) / RESOLUTION_M
    assert k.memory.potential[row * width + column] == pytest.approx(expected, rel=0.04)


def test_the_plan_goes_through_the_gap_it_sees_and_keeps_clear_of_walls() -> None:
    cells = hall()
    cells[:36, 25:28] = True
    driven = simulator(course(cells))
    driven.plan_commands(parameters(1))
    k = kernel(driven)
    plan = driven.plan(0)
    at_wall = plan[(plan[:, 0] > 2.5) & (plan[:, 0] < 2.8)]
    assert len(at_wall) > 0
    assert np.all(at_wall[:, 1] > 3.6 + 0.2)
    columns = ((plan[:, 0] - get(k.slot, "map_x")) / RESOLUTION_M).astype(int)
    rows = ((plan[:, 1] - get(k.slot, "map_y")) / RESOLUTION_M).astype(int)
    squared = k.memory.distances[rows * int(get(k.slot, "map_width")) + columns]
    assert np.all(k.memory.costs[0][squared] < INSCRIBED)


def test_unknown_space_is_free_until_it_is_seen() -> None:
    cells = hall()
    cells[:38, 60:62] = True  # 5 m ahead: beyond what the costmap marks
    driven = simulator(course(cells))
    driven.plan_commands(parameters(1))
    assert np.abs(driven.plan(0)[:, 1] - 2.5).max() < 0.1
    driven.advance(parameters(1), 160)
    assert driven.plan(0)[:, 1].max() > 4.0


def test_the_local_goal_is_a_metre_ahead_on_the_plan_in_the_robot_s_frame() -> None:
    driven = simulator(course(hall(), start=Pose2D(1.0, 2.5, math.pi / 2)))
    driven.plan_commands(parameters(1))
    np.testing.assert_allclose(driven.state().local_goals[0], [0.0, -1.0], atol=0.06)


def test_without_any_way_the_robot_has_no_plan() -> None:
    cells = hall()
    cells[15:36, 5:7] = True
    cells[15:36, 20:22] = True
    cells[15:17, 5:22] = True
    cells[34:36, 5:22] = True
    task = course(cells, start=Pose2D(1.4, 2.5, 0.0))
    driven = simulator(task)
    # The laser sees 270 degrees, so the last wall is seen only after turning.
    for _ in range(10):
        driven.advance(parameters(1, DWA_SLOW), 20)
    assert get(kernel(driven).slot, "search_needed")
    assert driven.state().outcomes[0] == 0


def _grid(drawn: str) -> OccupancyGrid:
    rows = [[cell == "#" for cell in row.strip()] for row in drawn.strip().splitlines()]
    return OccupancyGrid(cells=np.array(rows[::-1]), resolution=1.0)


def test_the_shortest_way_in_the_open_is_octile() -> None:
    grid = OccupancyGrid(cells=np.zeros((40, 40), dtype=np.bool_), resolution=0.1)
    length = optimal_path_length(grid, (1.05, 1.05), (3.05, 2.05), radius=0.2)
    assert length == pytest.approx(1.0 + math.sqrt(2.0))


def test_the_shortest_way_goes_round_and_does_not_cut_corners() -> None:
    grid = _grid(
        """
        .....
        .###.
        .....
        """
    )
    # Two rows up past the wall's end, whose corners may not be cut.
    assert optimal_path_length(grid, (3.5, 0.5), (3.5, 2.5), radius=0.5) == pytest.approx(4.0)


def test_there_is_no_way_through_a_gap_narrower_than_the_disc() -> None:
    cells = np.zeros((40, 40), dtype=np.bool_)
    cells[:, 20] = True
    cells[17:23, 20] = False
    grid = OccupancyGrid(cells=cells, resolution=0.1)
    assert optimal_path_length(grid, (1.0, 2.0), (3.0, 2.0), radius=0.25) < 2.3
    assert optimal_path_length(grid, (1.0, 2.0), (3.0, 2.0), radius=0.45) == math.inf


def test_there_is_no_way_from_inside_a_wall_or_from_outside_the_map() -> None:
    grid = OccupancyGrid(cells=hall(), resolution=0.1)
    assert optimal_path_length(grid, (0.05, 0.05), (3.0, 2.0), radius=0.1) == math.inf
    assert optimal_path_length(grid, (1.0, 1.0), (300.0, 2.0), radius=0.1) == math.inf
