import pytest

from ses_core.errors import SettingsError
from ses_core.extraction.robot_matching import Identity, identify, profile_of
from ses_core.robot_profile import RobotProfile
from ses_core.settings import IngestSettings, RobotRule


@pytest.mark.parametrize(
    ("relative", "site", "robot"),
    [
        ("berlin/r07/2026/a.bag", "berlin", "r07"),
        ("berlin/r07/a.bag", "berlin", "r07"),
        ("berlin/a.bag", "berlin", "unknown"),
        ("a.bag", "unknown", "unknown"),
    ],
)
def test_folders_say_site_and_robot(relative: str, site: str, robot: str) -> None:
    identity = identify(relative, IngestSettings())
    assert identity == Identity(site, robot)
    assert identity.is_complete == ("unknown" not in (site, robot))


def test_a_pattern_overrules_the_folders() -> None:
    settings = IngestSettings(identity_pattern=r"(?P<robot>r\d+)_(?P<site>[a-z]+)_")
    assert identify("x/y/r12_paris_monday.bag", settings) == Identity("paris", "r12")
    assert identify("x/y/other.bag", settings) == Identity("unknown", "unknown")


def test_a_pattern_that_is_none_is_an_error_of_the_settings() -> None:
    with pytest.raises(SettingsError, match="no regular expression"):
        identify("a.bag", IngestSettings(identity_pattern="("))


def test_the_first_rule_that_matches_gives_the_profile() -> None:
    own = RobotProfile(name="mule")
    settings = IngestSettings(
        robots=(
            RobotRule(match="*/neato*/*", profile="neato"),
            RobotRule(match="*/*/mule_*", profile="mule"),
        ),
        profiles={"mule": own},
    )
    assert profile_of(Identity("a", "neato3"), "mule_1.bag", settings).name == "neato"
    assert profile_of(Identity("a", "b"), "mule_1.bag", settings) is own
    assert profile_of(Identity("a", "b"), "c.bag", settings).name == "generic"


def test_a_rule_with_an_unknown_profile_is_an_error_of_the_settings() -> None:
    settings = IngestSettings(default_profile="spot")
    with pytest.raises(SettingsError, match="'spot' is not one of"):
        profile_of(Identity("a", "b"), "c.bag", settings)
