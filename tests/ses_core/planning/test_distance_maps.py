"""Steps to the plan and to the local goal against a plain search."""

from collections import deque

import numpy as np

from ses_core.arrays import BoolArray
from ses_core.planning.costmap import INSCRIBED, WINDOW_SIZE
from ses_core.planning.distance_maps import IMPOSSIBLE
from tests.simulated import Kernel, course, get, hall, planned


def _plan_cells(k: Kernel) -> list[tuple[int, int]]:
    plan = k.memory.plans[0, : int(get(k.slot, "plan_size"))]
    cells = []
    for x, y in plan:
        column = int(x) - int(get(k.slot, "window_column")) + 1
        row = int(y) - int(get(k.slot, "window_row")) + 1
        if not (1 <= column < WINDOW_SIZE - 1 and 1 <= row < WINDOW_SIZE - 1):
            break
        cells.append((row, column))
    return cells


def _steps(open_cells: BoolArray, sources: list[tuple[int, int]]) -> dict[tuple[int, int], int]:
    steps = dict.fromkeys(sources, 0)
    queue = deque(sources)
    while queue:
        row, column = queue.popleft()
        for cell in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
            if open_cells[cell] and cell not in steps:
                steps[cell] = steps[row, column] + 1
                queue.append(cell)
    return steps


def _open_cells(k: Kernel) -> BoolArray:
    is_open = k.memory.costs[0][k.memory.window_distances[0]] < INSCRIBED
    is_open[[0, -1], :] = False
    is_open[:, [0, -1]] = False
    return is_open


def _pillars() -> BoolArray:
    cells = hall()
    cells[18:22, 20:24] = True
    cells[28:34, 30:33] = True
    return cells


def test_steps_to_plan_and_goal_are_those_of_a_plain_search_near_the_robot() -> None:
    k = planned(course(_pillars()))
    cells = _plan_cells(k)
    is_open = _open_cells(k)
    to_plan, to_goal = _steps(is_open, cells), _steps(is_open, cells[-1:])
    middle = WINDOW_SIZE // 2
    reach = slice(middle - 22, middle + 23)
    checked = 0
    for row in range(WINDOW_SIZE)[reach]:
        for column in range(WINDOW_SIZE)[reach]:
            if is_open[row, column]:
                checked += 1
                found, expected = int(k.memory.path_steps[0, row, column]), to_plan[row, column]
                assert found == expected if expected <= 10 else found >= expected
                assert k.memory.goal_steps[0, row, column] == to_goal[row, column]
    assert checked > 1000


def test_cells_of_inscribed_cost_cannot_be_reached() -> None:
    k = planned(course(_pillars()))
    barred = ~_open_cells(k)
    assert np.all(k.memory.path_steps[0][barred] >= IMPOSSIBLE)
    assert np.all(k.memory.goal_steps[0][barred] >= IMPOSSIBLE)


def test_a_robot_standing_in_inscribed_cost_can_still_find_out() -> None:
    cells = hall()
    cells[28:31, 10:40] = True  # the face of a wall 0.3 m to the left of the robot
    k = planned(course(cells))
    middle = WINDOW_SIZE // 2 + 1
    # 0.1 m to the left of its centre the cost is inscribed, but it is under the robot.
    assert k.memory.costs[0][k.memory.window_distances[0, middle + 2, middle + 6]] >= INSCRIBED
    assert k.memory.goal_steps[0, middle + 2, middle + 4] < IMPOSSIBLE
    assert k.memory.goal_steps[0, middle + 2, middle + 12] >= IMPOSSIBLE
