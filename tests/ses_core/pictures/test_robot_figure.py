"""The picture of a robot: its body, its padding and what its laser sees, to scale."""

import numpy as np
import pytest

from ses_core.pictures.figures import DARK, LIGHT, Theme
from ses_core.pictures.robot_figure import robot_figure
from ses_core.robot_profile import JACKAL, KNOWN_PROFILES, TURTLEBOT4, LaserProfile, RobotProfile
from tests.ses_core.pictures.pictured import pixels


def shaded(profile: RobotProfile, *, theme: Theme = LIGHT) -> float:
    """Share of the picture that differs from the same robot with a laser that sees nothing."""
    blind = profile.model_copy(
        update={"laser": LaserProfile(angle_min_rad=0.0, angle_max_rad=1e-6)}
    )
    sees, not_so = (pixels(robot_figure(one, theme=theme)).astype(int) for one in (profile, blind))
    return float((np.abs(sees - not_so).max(axis=2) > 4).mean())


@pytest.mark.parametrize("profile", KNOWN_PROFILES.values(), ids=lambda profile: profile.name)
def test_every_robot_is_drawn_for_light_and_dark_pages(profile: RobotProfile) -> None:
    light, dark = robot_figure(profile), robot_figure(profile, theme=DARK)
    assert light == robot_figure(profile) != dark
    assert pixels(light).shape[0] > 300


def test_robots_differ_in_body_and_in_what_they_see() -> None:
    assert robot_figure(JACKAL) != robot_figure(TURTLEBOT4)
    assert shaded(TURTLEBOT4) > 1.1 * shaded(JACKAL) > 0.2
