"""All of section III-B for one log: trajectories -> scenarios with their places."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ses_core.extraction.difficulty import DifficultyMeasures, measure_difficulty
from ses_core.extraction.reconstruction import Reconstruction, reconstruct
from ses_core.extraction.recording import RecordedMap
from ses_core.extraction.scenario import Scenario, scenario_id
from ses_core.extraction.segmentation import segment
from ses_core.extraction.trajectory import Trajectory
from ses_core.navigation import NavigationEnvironment
from ses_core.recipes import digest_bytes, digest_json
from ses_core.robot_profile import RobotProfile
from ses_core.settings import ExtractionSettings
from ses_core.synthesis.traversability import traversable

TERMINAL_DISTANCE_M = 1.0
"""A terminal segment that got no farther [m] has no direction to lay its window along."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceQuality:
    """How far a reconstructed place can be trusted, and how hard it looks.

    Attributes:
        observed_fraction: Share of the cells that were seen.
        path_in_free_fraction: Share of the robot's own path that lies in free cells, before
            the path corrected any.
        overridden_cells: Occupied cells freed because the robot drove there.
        contradicted_fraction: Share of beam ends that most beams looked through; None from a map.
        is_traversable: The target robot's disc gets from start to goal.
        difficulty: BARN's measures for the target; None where it cannot cross.
    """

    observed_fraction: float
    path_in_free_fraction: float
    overridden_cells: int
    contradicted_fraction: float | None
    is_traversable: bool
    difficulty: DifficultyMeasures | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ExtractedScenario:
    """A scenario with the place it happened in; both None where no sensor and no map show it."""

    scenario_id: str
    scenario: Scenario
    environment: NavigationEnvironment | None
    quality: PlaceQuality | None


def extract(
    trajectories: Sequence[Trajectory],
    *,
    log_id: str,
    recorded_map: RecordedMap | None,
    settings: ExtractionSettings,
    profile: RobotProfile,
    target: RobotProfile,
) -> list[ExtractedScenario]:
    """Cut one log's trajectories into scenarios and rebuild each one's place.

    Terminal segments have a place only where they got more than 1 m from their start.

    Args:
        trajectories: The unbroken drives of the log, in order.
        log_id: Digest of the log; identities derive from it.
        recorded_map: A map in the frame of the poses, from the log or of its site.
        settings: How to cut and how to rebuild.
        profile: The robot that drove.
        target: The robot that has to cross the places and is trained in them.
    """
    extracted = []
    for index, trajectory in enumerate(trajectories):
        ends_in_cut = index < len(trajectories) - 1
        for scenario in segment(trajectory, settings=settings, ends_in_cut=ends_in_cut):
            identity = scenario_id(log_id, scenario)
            place = None
            if _has_direction(scenario):
                place = reconstruct(
                    trajectory,
                    scenario,
                    recorded_map=recorded_map,
                    settings=settings,
                    body_radius=profile.inscribed_radius_m - profile.footprint_padding_m,
                )
            extracted.append(
                ExtractedScenario(
                    scenario_id=identity,
                    scenario=scenario,
                    environment=_environment(place, identity) if place else None,
                    quality=_quality(place, target) if place else None,
                )
            )
    return extracted


def _has_direction(scenario: Scenario) -> bool:
    distance = math.dist((scenario.start.x, scenario.start.y), scenario.goal)
    return scenario.kind == "scenario" or distance > TERMINAL_DISTANCE_M


def _environment(place: Reconstruction, identity: str) -> NavigationEnvironment:
    content = digest_bytes(place.cells.tobytes() + place.observed.tobytes())
    return NavigationEnvironment(
        environment_id=digest_json([place.origin, content, identity])[:16],
        cells=place.cells,
        observed=place.observed,
        origin=place.origin,
        scenario_id=identity,
    )


def _quality(place: Reconstruction, target: RobotProfile) -> PlaceQuality:
    radius = target.inscribed_radius_m
    return PlaceQuality(
        observed_fraction=float(place.observed.mean()),
        path_in_free_fraction=place.path_in_free_fraction,
        overridden_cells=place.overridden_cells,
        contradicted_fraction=place.contradicted_fraction,
        is_traversable=bool(traversable(place.cells[None], radius=radius)[0]),
        difficulty=measure_difficulty(place.cells, radius=radius),
    )
