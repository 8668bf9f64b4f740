"""Robot profiles: shapes and their circles."""

import pytest
from pydantic import ValidationError

from ses_core.robot_profile import JACKAL, KNOWN_PROFILES, NEATO, RobotProfile


def test_the_jackals_padded_circles_are_those_of_its_costmap() -> None:
    assert JACKAL.inscribed_radius_m == pytest.approx(0.265)
    assert JACKAL.circumscribed_radius_m == pytest.approx(0.408, abs=5e-4)


def test_a_round_robot_has_equal_circles_and_a_round_body() -> None:
    assert NEATO.inscribed_radius_m == NEATO.circumscribed_radius_m == pytest.approx(0.2)
    assert len(NEATO.body()) == 16
    assert all(x * x + y * y == pytest.approx(0.17**2) for x, y in NEATO.body())


def test_a_robot_with_no_shape_or_two_is_refused() -> None:
    with pytest.raises(ValidationError, match="either a footprint"):
        RobotProfile(name="none", footprint_m=())
    with pytest.raises(ValidationError, match="either a footprint"):
        RobotProfile(name="both", radius_m=0.2)


def test_an_unknown_key_in_a_profile_is_refused() -> None:
    with pytest.raises(ValidationError, match="max_speed"):
        RobotProfile.model_validate({"max_speed": 1.0})


def test_known_profiles_go_by_their_own_names() -> None:
    assert {"jackal", "turtlebot4", "neato", "raspimouse", "generic"} <= set(KNOWN_PROFILES)
    assert all(name == profile.name for name, profile in KNOWN_PROFILES.items())
