"""How hard a scenario was, and how hard a place looks: counts, and BARN's five measures."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ses_core.arrays import BoolArray, FloatArray
from ses_core.compilation import compiled
from ses_core.extraction.scenario import Scenario
from ses_core.occupancy import ENVIRONMENT_RESOLUTION_M, ENVIRONMENT_SIDE_M, environment_course
from ses_core.settings import FilterSettings
from ses_core.synthesis.traversability import NODES_PER_CELL, node_clearance, path_through

CountKind = Literal["negative", "not-forward", "reversing-seconds"]

DISPERSION_RADIUS_M = 3 * ENVIRONMENT_RESOLUTION_M
"""How far dispersion looks [m]: BARN's 3 cells."""

OPEN_END_M = ENVIRONMENT_SIDE_M / 2
"""Open space [m] at both ends while measuring, so that their walls are nearer than no side."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DifficultyMeasures:
    """BARN's measures of a place, each but the last averaged along the shortest path.

    All are taken in the configuration space of the target's disc, as BARN's are in that of
    its robot (Perille et al. 2020, section IV), and given in metres instead of cells.

    Attributes:
        closest_obstacle: To the nearest obstacle [m].
        visibility: Mean free length [m] over 8 directions.
        dispersion: Changes between free and blocked around 16 directions, 0.5 m far.
        characteristic_dimension: Least free length [m], both ways, over 4 axes.
        tortuosity: Length of the path over the straight distance.
    """

    closest_obstacle: float
    visibility: float
    dispersion: float
    characteristic_dimension: float
    tortuosity: float


def count_of(scenario: Scenario, kind: CountKind) -> float | None:
    """Give the count that a kind names; None where it is unknown."""
    match kind:
        case "negative":
            return scenario.negative_velocity_count
        case "not-forward":
            return scenario.not_forward_count
        case "reversing-seconds":
            return scenario.reversing_s


def is_challenging(scenario: Scenario, settings: FilterSettings) -> bool:
    """Tell whether a scenario's count is strictly above the threshold (section III-B).

    Terminal segments and unknown counts never are. A share is a choice among many scenarios
    and has no say here.
    """
    count = count_of(scenario, settings.count_kind)
    return scenario.kind == "scenario" and count is not None and count > settings.threshold


def measure_difficulty(cells: BoolArray, *, radius: float) -> DifficultyMeasures | None:
    """Measure an environment (30, 30) for a disc of a radius [m]; None where it cannot cross."""
    course = environment_course(cells, apron=OPEN_END_M)
    clearance = node_clearance(course)
    path = path_through(course, clearance, radius)
    if path is None:
        return None
    spacing = course.resolution / NODES_PER_CELL
    clearance -= radius
    nodes = np.rint((path - course.origin) / spacing).astype(np.int64)
    along_path = np.maximum(clearance[nodes[:, 1], nodes[:, 0]], 0.0)
    visibility, characteristic, dispersion = _look_around(
        clearance >= 0.0, (path - course.origin) / spacing, DISPERSION_RADIUS_M / spacing
    )
    steps = np.diff(path, axis=0)
    return DifficultyMeasures(
        closest_obstacle=float(along_path.mean()),
        visibility=visibility * spacing,
        dispersion=dispersion,
        characteristic_dimension=characteristic * spacing,
        tortuosity=float(np.hypot(steps[:, 0], steps[:, 1]).sum()) / math.dist(path[0], path[-1]),
    )


@compiled
def _look_around(
    free: BoolArray, path: FloatArray, dispersion_radius: float
) -> tuple[float, float, float]:
    """Average visibility, characteristic dimension and dispersion along a path; in nodes."""
    lengths = np.empty(16)
    visibility, characteristic, dispersion = 0.0, 0.0, 0.0
    for point in range(path.shape[0]):
        for direction in range(16):
            lengths[direction] = _free_length(
                free, path[point, 0], path[point, 1], direction * math.pi / 8.0
            )
        visibility += lengths[::2].mean()
        narrowest = math.inf
        for axis in range(0, 8, 2):
            narrowest = min(narrowest, lengths[axis] + lengths[axis + 8])
        characteristic += narrowest
        for direction in range(16):
            is_blocked = lengths[direction] < dispersion_radius
            dispersion += is_blocked != (lengths[direction - 1] < dispersion_radius)
    count = path.shape[0]
    return visibility / count, characteristic / count, dispersion / count


@compiled
def _free_length(free: BoolArray, x: float, y: float, angle: float) -> float:
    """Length [nodes] from a point to the first blocked node or the border, by unit steps."""
    dx, dy = math.cos(angle), math.sin(angle)
    length = 0
    while True:
        column, row = round(x + (length + 1) * dx), round(y + (length + 1) * dy)
        inside = 0 <= row < free.shape[0] and 0 <= column < free.shape[1]
        if not inside or not free[row, column]:
            return float(length)
        length += 1
