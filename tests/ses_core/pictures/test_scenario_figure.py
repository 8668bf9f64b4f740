"""The picture of a scenario: it shows what happened, also where little is known."""

from dataclasses import replace

import numpy as np
import pytest

from ses_core.geometry import Pose2D
from ses_core.pictures.figures import DARK, LIGHT, Theme
from ses_core.pictures.scenario_figure import (
    quality_rows,
    scan_points,
    scenario_figure,
    scenario_rows,
)
from ses_core.robot_profile import JACKAL, RobotProfile
from tests.ses_core.pictures.pictured import draws, drive, extracted, pixels


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_a_scenario_is_drawn_with_obstacles_unseen_cells_and_both_ways(theme: Theme) -> None:
    trajectory = drive()
    one = extracted(trajectory)[0]
    png = scenario_figure(one, trajectory, target=JACKAL, scan_margin=1.0, theme=theme)
    picture = pixels(png)
    assert picture.shape[1] > picture.shape[0] > 400
    assert one.environment is not None
    cell = draws(picture, theme.occupied) / one.environment.cells.sum()
    assert 50 < cell < 400
    assert draws(picture, theme.unknown) > 50 * (~one.environment.observed).sum()
    assert draws(picture, theme.series[0]) > 200
    assert png == scenario_figure(one, trajectory, target=JACKAL, scan_margin=1.0, theme=theme)


def test_reversing_is_marked_and_only_where_it_happened() -> None:
    there, back = drive(), drive(reversing=True)
    counts = [
        draws(
            pixels(scenario_figure(extracted(one)[0], one, target=JACKAL, scan_margin=1.0)),
            LIGHT.series[1],
        )
        for one in (there, back)
    ]
    assert counts[1] > counts[0] + 300


def test_the_body_of_the_robot_is_drawn_on_its_way() -> None:
    trajectory = drive()
    one = extracted(trajectory)[0]
    tinted = "#eed2bc"  # a quarter of vermilion over free cells
    inside = []
    for radius in (0.1, 0.2):
        robot = RobotProfile(name="disc", footprint_m=(), radius_m=radius)
        picture = pixels(scenario_figure(one, trajectory, target=robot, scan_margin=1.0))
        inside.append(draws(picture, tinted))
    assert inside[0] > 100
    assert inside[1] > 4 * inside[0]


def test_scan_points_lie_on_the_walls() -> None:
    trajectory = drive()
    points = scan_points(trajectory, slice(None), Pose2D(0.0, 0.0))
    on_side = np.abs(np.abs(points[:, 1]) - 1.0) < 1e-4
    assert on_side.mean() > 0.8
    assert len(scan_points(trajectory, slice(None), Pose2D(0.0, 0.0), most=100)) <= 100


def test_what_is_unknown_is_called_unknown() -> None:
    trajectory = replace(drive(), has_clock=False, scans=None, scan_poses=None)
    one = extracted(trajectory)[0]
    assert ("steps with v < 0", "unknown") in scenario_rows(one.scenario)
    assert ("duration", "unknown") in scenario_rows(one.scenario)
    assert quality_rows(one.quality) == [("place", "not rebuilt")]
    speedless = replace(trajectory, speed=np.full(len(trajectory), np.nan))
    png = scenario_figure(one, speedless, target=JACKAL, scan_margin=1.0)
    assert draws(pixels(png), LIGHT.occupied) == 0
