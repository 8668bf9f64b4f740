"""The one rule by which start-goal pairs are drawn in a world.

The rule of the authors' deployments (ros_jackal, dwa_habitat.py), in terms of the robot: walls
grow by its inscribed radius, the map is divided into blocks of 0.3 m, a robot can stand in the
middle of a block that is free as a whole, and gets from block to block over their edges. So a
door counts as a way if it is wider than the robot by more than a block: narrower ones the robot
fits through, but its local planner turns on the spot before them for ever. Pairs are uniform over
the places that have a partner at least `min_distance` away in a straight line; the robot starts
heading for its goal.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.random import Generator
from scipy import ndimage

from ses_core.arrays import FloatArray, IntArray
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import RobotProfile

MIN_DISTANCE_M = 6.6
"""Least straight distance of a pair [m], as in the authors' deployments."""

BLOCK_M = 0.3
"""Edge of a block [m], as in the authors' deployments."""

PairPreset = Literal["default", "long"]

_LONG_SHARE = 0.9
"""`long`: at least this share of the farthest that two places with a way between them are apart."""

_DIRECTIONS = 90
"""In which a region is measured; between them its extent is 0.02 % more at most."""

_DRAWS = 4096
"""Pairs drawn at once."""

_VAIN_DRAWS = 64 * _DRAWS
"""After so many pairs without a single one far enough apart, a world has none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StandingPlaces:
    """Where a robot can stand: points (K, 2) [m], and which connected region (K,) each is in."""

    points: FloatArray
    regions: IntArray


def sample_tasks(
    world: World,
    count: int,
    *,
    profile: RobotProfile,
    rng: Generator,
    min_distance: float = MIN_DISTANCE_M,
    preset: PairPreset = "default",
) -> list[NavigationTask]:
    """Draw tasks in a world, their straight start-goal distance at least `min_distance` [m].

    The preset `long` asks for pairs nearly as far apart as any in that world, to get more
    scenarios out of a deployment: the paper's come to 3.3 each. A world that has pairs has long
    ones too.

    Returns:
        `count` tasks; the one course of a world that has a course; none where no two places
        are far enough apart.
    """
    if world.course is not None:
        start, goal = world.course
        return [NavigationTask(world=world, start=start, goal=goal)]
    places = standing_places(world.grid, profile)
    if preset == "long":
        min_distance = max(min_distance, _LONG_SHARE * farthest_apart(places))
    starts, goals = _draw_pairs(places, count, min_distance=min_distance, rng=rng)
    return [
        NavigationTask(
            world=world,
            start=Pose2D(x, y, math.atan2(goal_y - y, goal_x - x)),
            goal=(goal_x, goal_y),
        )
        for (x, y), (goal_x, goal_y) in zip(starts.tolist(), goals.tolist(), strict=True)
    ]


def standing_places(grid: OccupancyGrid, profile: RobotProfile) -> StandingPlaces:
    """Find every block a robot can stand in, and which it can reach from which."""
    walled = np.pad(grid.cells, 1, constant_values=True)
    # From cell centre to cell centre; a wall begins half a cell before its centre.
    distance = ndimage.distance_transform_edt(~walled)[1:-1, 1:-1]
    free = (distance - 0.5) * grid.resolution >= profile.inscribed_radius_m
    size = max(1, round(BLOCK_M / grid.resolution))
    height, width = (cells // size for cells in grid.cells.shape)
    blocks = free[: height * size, : width * size].reshape(height, size, width, size)
    passable = blocks.all(axis=(1, 3))
    regions, _ = ndimage.label(passable)
    row, column = np.nonzero(passable)
    middles = (np.column_stack((column, row)) + 0.5) * size * grid.resolution
    return StandingPlaces(
        points=middles + np.asarray(grid.origin), regions=regions[row, column].astype(np.int64)
    )


def farthest_apart(places: StandingPlaces) -> float:
    """Measure how far apart [m] two places are at most that have a way between them."""
    if not len(places.points):
        return 0.0
    angles = np.arange(_DIRECTIONS) * math.pi / _DIRECTIONS
    along = places.points @ np.array([np.cos(angles), np.sin(angles)])
    order = np.argsort(places.regions, kind="stable")
    starts = np.flatnonzero(np.diff(places.regions[order], prepend=-1))
    extents = np.maximum.reduceat(along[order], starts) - np.minimum.reduceat(along[order], starts)
    return float(extents.max())


def _draw_pairs(
    places: StandingPlaces, count: int, *, min_distance: float, rng: Generator
) -> tuple[FloatArray, FloatArray]:
    """Draw starts and goals (count, 2) [m] by rejection; none if no draw is ever accepted."""
    accepted: list[IntArray] = []
    found, drawn, size = 0, 0, len(places.points)
    while size and found < count and (found or drawn < _VAIN_DRAWS):
        pairs = rng.integers(size, size=(_DRAWS, 2))
        apart = np.linalg.norm(places.points[pairs[:, 0]] - places.points[pairs[:, 1]], axis=1)
        together = places.regions[pairs[:, 0]] == places.regions[pairs[:, 1]]
        accepted.append(pairs[together & (apart >= min_distance)])
        found += len(accepted[-1])
        drawn += _DRAWS
    if not found:
        return np.zeros((0, 2)), np.zeros((0, 2))
    pairs = np.concatenate(accepted)[:count]
    return places.points[pairs[:, 0]], places.points[pairs[:, 1]]
