"""From trajectories to scenarios with places and their quality."""

from dataclasses import replace

import numpy as np
import pytest

from ses_core.extraction.extract import ExtractedScenario, extract
from ses_core.extraction.trajectory import Trajectory
from ses_core.robot_profile import GENERIC, JACKAL, RobotProfile
from ses_core.settings import ExtractionSettings
from tests.ses_core.extraction.drives import CORRIDOR, scanned_drive, straight

BIG_CIRCLE = RobotProfile(name="big", footprint_m=(), radius_m=0.45, footprint_padding_m=0.0)


def extracted(
    *trajectories: Trajectory, log_id: str = "log", target: RobotProfile = JACKAL
) -> list[ExtractedScenario]:
    return extract(
        trajectories,
        log_id=log_id,
        recorded_map=None,
        settings=ExtractionSettings(),
        profile=GENERIC,
        target=target,
    )


def test_a_log_gives_scenarios_and_one_rest_per_drive() -> None:
    drive = scanned_drive(straight(7.0), CORRIDOR)
    found = extracted(drive, drive)
    assert [one.scenario.kind for one in found] == ["scenario", "terminal"] * 2
    assert [one.scenario.outcome for one in found] == ["", "cut", "", "moving"]
    assert all(one.environment is not None for one in found)
    assert found[0].environment is not None
    assert found[0].environment.scenario_id == found[0].scenario_id


def test_a_rest_that_got_no_farther_than_a_metre_has_no_place() -> None:
    found = extracted(scanned_drive(straight(6.0), CORRIDOR))
    assert found[1].scenario.kind == "terminal"
    assert found[1].environment is None
    assert found[1].quality is None


def test_quality_says_what_the_target_can_cross() -> None:
    drive = scanned_drive(straight(5.1), CORRIDOR)
    by_jackal = extracted(drive)[0].quality
    by_giant = extracted(drive, target=BIG_CIRCLE)[0].quality
    assert by_jackal is not None
    assert by_giant is not None
    assert by_jackal.is_traversable
    assert by_jackal.difficulty is not None
    assert by_jackal.path_in_free_fraction == 1.0
    assert 0.3 < by_jackal.observed_fraction < 0.6
    # Between pillar and wall are 1.4 m, but the pillar stands 0.4 m from the middle.
    assert by_giant.is_traversable
    blocked = scanned_drive(straight(5.1), CORRIDOR * np.array([1.0, 0.4, 1.0, 0.4]))
    narrow = extracted(blocked, target=BIG_CIRCLE)[0].quality
    assert narrow is not None
    assert not narrow.is_traversable
    assert narrow.difficulty is None


def test_equal_logs_give_equal_environments_and_other_logs_other_identities() -> None:
    drive = scanned_drive(straight(5.1), CORRIDOR)
    once, again = extracted(drive)[0].environment, extracted(drive)[0].environment
    other = extracted(drive, log_id="other")[0].environment
    assert once is not None
    assert again is not None
    assert other is not None
    assert once.environment_id == again.environment_id
    assert once.environment_id != other.environment_id
    assert (once.cells == other.cells).all()


def test_a_log_without_scans_still_gives_its_scenarios() -> None:
    drive = scanned_drive(straight(5.1), CORRIDOR)
    found = extracted(replace(drive, scans=None, scan_poses=None))
    assert [one.environment for one in found] == [None, None]
    assert found[0].scenario.arc_length_m == pytest.approx(5.025)
