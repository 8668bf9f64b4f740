"""One scenario's place in several forms, one thing about it changed at a time."""

import math
from collections.abc import Callable

import numpy as np
from _driven_scenarios import DrivenScenario

from ses_core.arrays import BoolArray, FloatArray
from ses_core.evaluation.difficulty import approach_heading
from ses_core.extraction.reconstruction import FINE, FINE_RESOLUTION_M
from ses_core.geometry import Pose2D, from_frame
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import (
    ENVIRONMENT_CELLS,
    ENVIRONMENT_SIDE_M,
    OccupancyGrid,
    cell_centres,
    environment_course,
    environment_to_grid,
    occupied_at,
)

AROUND_M = 3.0
"""How far the true map is known beyond the window [m]."""

_SAMPLES = 2  # of the true map along the side of a fine cell, lest a thin wall be missed

Form = Callable[[DrivenScenario], NavigationTask]


def rebuilt(
    one: DrivenScenario,
    *,
    apron: float = 1.0,
    is_heading_kept: bool = False,
    is_unknown_occupied: bool = False,
) -> NavigationTask:
    """Give the place as it was rebuilt from scans, between aprons [m]."""
    cells = one.environment.cells
    if is_unknown_occupied:
        cells = cells | ~one.environment.observed
    yaw = _heading(one) if is_heading_kept else 0.0
    return _task(one, environment_course(cells, apron=apron), yaw)


def surrounded(
    one: DrivenScenario, *, is_heading_kept: bool = False, is_window_true: bool = False
) -> NavigationTask:
    """Give the window, rebuilt or cut from the true map, in its true surroundings."""
    grid = _true_surroundings(one)
    margin = round(AROUND_M / FINE_RESOLUTION_M)
    inside = slice(margin, margin + FINE * ENVIRONMENT_CELLS)
    window = environment_to_grid(one.environment.cells).cells
    if is_window_true:
        blocks = grid.cells[inside, inside].reshape(ENVIRONMENT_CELLS, FINE, -1, FINE)
        window = blocks.any(axis=(1, 3))
    grid.cells[inside, inside] = np.repeat(np.repeat(window, FINE, axis=0), FINE, axis=1)
    return _task(one, grid, _heading(one) if is_heading_kept else 0.0)


def true_place(one: DrivenScenario) -> NavigationTask:
    """Give the scenario in its house, started as it truly was but for its speed."""
    world = World(world_id=one.environment.environment_id, grid=one.house.grid)
    return NavigationTask(world=world, start=one.start, goal=one.goal)


FORMS: dict[str, Form] = {
    "heading for the goal": rebuilt,
    "heading as logged": lambda one: rebuilt(one, is_heading_kept=True),
    "apron 0.5 m": lambda one: rebuilt(one, apron=0.5),
    "apron 2 m": lambda one: rebuilt(one, apron=2.0),
    "apron 3 m": lambda one: rebuilt(one, apron=3.0),
    "unknown occupied": lambda one: rebuilt(one, is_unknown_occupied=True),
    "true surroundings": surrounded,
    "true surroundings, heading as logged": lambda one: surrounded(one, is_heading_kept=True),
    "true surroundings and window, heading as logged": lambda one: surrounded(
        one, is_heading_kept=True, is_window_true=True
    ),
    "true place": true_place,
}
"""What is compared: the first is what the others are set against, the second what nights do."""


def _task(one: DrivenScenario, grid: OccupancyGrid, yaw: float) -> NavigationTask:
    world = World(world_id=one.environment.environment_id, grid=grid)
    return NavigationTask(world=world, start=Pose2D(0.0, 0.0, yaw), goal=(ENVIRONMENT_SIDE_M, 0.0))


def _heading(one: DrivenScenario) -> float:
    """Give the heading [rad] at the first step, in the frame of the scenario."""
    return approach_heading(one.scenario.start, one.scenario.goal)


def _true_surroundings(one: DrivenScenario) -> OccupancyGrid:
    """Sample the house around a scenario, in the scenario's frame and in fine cells."""
    frame = Pose2D(
        one.start.x,
        one.start.y,
        math.atan2(one.goal[1] - one.start.y, one.goal[0] - one.start.x),
    )
    side = round((ENVIRONMENT_SIDE_M + 2.0 * AROUND_M) / FINE_RESOLUTION_M)
    origin = (-AROUND_M, -ENVIRONMENT_SIDE_M / 2.0 - AROUND_M)
    samples = OccupancyGrid(
        cells=np.zeros((_SAMPLES * side, _SAMPLES * side), dtype=np.bool_),
        resolution=FINE_RESOLUTION_M / _SAMPLES,
        origin=origin,
    )
    rows, columns = np.indices(samples.cells.shape)
    points: FloatArray = cell_centres(samples, np.column_stack((columns.ravel(), rows.ravel())))
    occupied = occupied_at(one.house.grid, from_frame(points, frame))
    blocks: BoolArray = occupied.reshape(side, _SAMPLES, side, _SAMPLES).any(axis=(1, 3))
    return OccupancyGrid(cells=blocks, resolution=FINE_RESOLUTION_M, origin=origin)
