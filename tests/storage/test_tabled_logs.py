"""Logs that come as tables: taken in like bags of the same drives."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ses_core.extraction.extract import ExtractedScenario, extract
from ses_core.robot_profile import GENERIC, JACKAL
from ses_core.settings import ExtractionSettings, IngestSettings
from storage.deployment_logs import FleetFormat
from storage.log_catalogue import catalogue
from storage.trajectory_tables import read_log_row, read_trajectories
from tests.storage.tabled_fleet import Night, log_in, read, write_fleet

Scenarios = dict[tuple[object, ...], list[ExtractedScenario]]


def scenarios_of(night: Night) -> Scenarios:
    """Give the scenarios of each log, by site, robot and name."""
    extracted: Scenarios = {}
    for log in catalogue(night.tables):
        folder = night.store.path(log.ref)
        row = read_log_row(folder)
        extracted[row["site"], row["robot"], str(row["name"]).removesuffix(".bag")] = extract(
            read_trajectories(folder),
            log_id="same",
            recorded_map=None,
            settings=ExtractionSettings(),
            profile=GENERIC,
            target=JACKAL,
        )
    return extracted


def compare(one: ExtractedScenario, other: ExtractedScenario) -> None:
    assert one.scenario == other.scenario
    assert one.quality == other.quality
    if one.environment is None or other.environment is None:
        assert one.environment is other.environment
        return
    assert np.array_equal(one.environment.cells, other.environment.cells)
    assert np.array_equal(one.environment.observed, other.environment.observed)


def scenarios_by(folder: Path, log_format: FleetFormat, pose_source: Any) -> Scenarios:
    """Write the fleet in a format, take its logs in, and extract them."""
    write_fleet(folder / "inbox", log_format, drives_per_log=3, publishes_map=pose_source == "map")
    night = Night(folder / "store", IngestSettings(pose_source=pose_source))
    assert [one.status for one in night.take_in(folder / "inbox")] == ["new"] * 2
    return scenarios_of(night)


@pytest.fixture(scope="module")
def direct(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Scenarios]:
    return {
        source: scenarios_by(tmp_path_factory.mktemp(source), "tables", source)
        for source in ("odometry", "map")
    }


@pytest.mark.parametrize(
    ("log_format", "pose_source"),
    [("mcap", "odometry"), ("bag", "odometry"), ("db3", "odometry"), ("mcap", "map")],
)
def test_bags_and_tables_of_the_same_drives_give_identical_scenarios(
    tmp_path: Path, direct: dict[str, Scenarios], log_format: FleetFormat, pose_source: str
) -> None:
    by_bag = scenarios_by(tmp_path, log_format, pose_source)
    assert by_bag.keys() == direct[pose_source].keys()
    assert sum(len(scenarios) for scenarios in by_bag.values()) > 12
    for log, scenarios in direct[pose_source].items():
        assert len(scenarios) == len(by_bag[log])
        for one, other in zip(scenarios, by_bag[log], strict=True):
            compare(one, other)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    inbox = tmp_path_factory.mktemp("fleet")
    write_fleet(inbox, "tables", publishes_map=True)
    return inbox


def test_tables_are_known_by_their_content(tmp_path: Path, fleet: Path) -> None:
    inbox = tmp_path / "inbox"
    shutil.copytree(fleet, inbox)
    night = Night(tmp_path / "store")
    first = night.take_in(inbox)
    assert {one.status for one in first} == {"new"}
    assert night.take_in(inbox) == []
    (log, *_) = sorted(inbox.glob("*/*/*.done"))
    log.with_suffix("").rename(log.parent / "moved")
    log.rename(log.parent / "moved.done")
    (again,) = night.take_in(inbox)
    assert (again.status, again.log_id in {one.log_id for one in first}) == ("known", True)


@pytest.mark.parametrize("source", ["measured", "commanded", "derived"])
def test_the_night_s_own_settings_say_which_velocity_counts(fleet: Path, source: Any) -> None:
    drives = read(log_in(fleet), IngestSettings(velocity_source=source))
    assert len(drives) == 3
    for drive in drives:
        if source == "derived":
            assert np.mean(np.abs(drive.speed - drive.measured[:, 0])) < 0.05
        else:
            assert np.array_equal(drive.speed, getattr(drive, source)[:, 0])
