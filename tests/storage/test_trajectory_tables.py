from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ses_core.extraction.recording import Recording
from ses_core.extraction.resampling import resample
from ses_core.robot_profile import GENERIC
from ses_core.settings import IngestSettings
from storage.trajectory_tables import (
    LogDescription,
    read_log_row,
    read_recorded_map,
    read_trajectories,
    write_ingested,
)
from tests.log_factory import drive

DESCRIPTION = LogDescription(
    log_id="a" * 64,
    name="monday.bag",
    robot="r1",
    site="berlin",
    format="rosbag1",
    batch_date=date(2026, 11, 22),
    profile="generic",
    velocity_source="commanded",
)


def recorded(*, has_hole: bool = False, with_scans: bool = True) -> Recording:
    content = drive()
    stamps = content.poses.stamps_ns.copy()
    if has_hole:
        stamps[200:] += 30_000_000_000
    return Recording(
        poses=replace(content.poses, stamps_ns=stamps),
        commands=content.commands,
        scans=content.scans if with_scans else None,
        map=content.map,
        pose_source="odometry",
        has_clock=True,
        messages_in=10,
        messages_used=9,
        warnings={"dropped_malformed": 1},
    )


def test_trajectories_come_back_equal(tmp_path: Path) -> None:
    recording = recorded(has_hole=True)
    trajectories = resample(recording, profile=GENERIC, settings=IngestSettings())
    assert len(trajectories) == 2
    write_ingested(tmp_path, DESCRIPTION, recording, trajectories, cut_counts={"gap_cuts": 1})
    found = read_trajectories(tmp_path)
    assert len(found) == 2
    for wrote, read in zip(trajectories, found, strict=True):
        assert (read.first_step, read.has_clock) == (wrote.first_step, wrote.has_clock)
        for name in ("stamps_ns", "poses", "commanded", "measured", "speed"):
            np.testing.assert_array_equal(getattr(read, name), getattr(wrote, name))
        if wrote.scans is None or len(wrote.scans.stamps_ns) == 0:
            assert read.scans is None
            continue
        assert read.scans is not None
        np.testing.assert_array_equal(read.scans.stamps_ns, wrote.scans.stamps_ns)
        np.testing.assert_array_equal(read.scans.ranges, wrote.scans.ranges)
        np.testing.assert_allclose(read.scans.angles, wrote.scans.angles, atol=1e-12)
        assert (read.scans.mount, read.scans.range_max) == (wrote.scans.mount, 10.0)
        np.testing.assert_array_equal(read.scan_poses, wrote.scan_poses)


def test_the_map_and_the_row_of_the_log_come_back(tmp_path: Path) -> None:
    recording = recorded()
    trajectories = resample(recording, profile=GENERIC, settings=IngestSettings())
    write_ingested(tmp_path, DESCRIPTION, recording, trajectories, cut_counts={"gap_cuts": 0})
    row = read_log_row(tmp_path)
    assert (row["log_id"], row["site"], row["batch_date"]) == ("a" * 64, "berlin", "2026-11-22")
    assert row["steps"] == sum(len(trajectory) for trajectory in trajectories)
    assert row["warnings"] == {"dropped_malformed": 1}
    assert float(str(row["path_length_m"])) == pytest.approx(10.0, abs=0.1)
    found = read_recorded_map(tmp_path)
    assert found is not None
    assert recording.map is not None
    np.testing.assert_array_equal(found.cells, recording.map.cells)
    assert (found.resolution, found.origin) == (recording.map.resolution, recording.map.origin)


def test_unknown_speeds_are_null_in_the_table_and_never_false(tmp_path: Path) -> None:
    recording = replace(recorded(with_scans=False), has_clock=False)
    trajectories = resample(recording, profile=GENERIC, settings=IngestSettings())
    write_ingested(tmp_path, DESCRIPTION, recording, trajectories, cut_counts={})
    table = pd.read_parquet(tmp_path / "trajectories.parquet")
    assert table["negative_velocity"].isna().all()
    (trajectory,) = read_trajectories(tmp_path)
    assert np.isnan(trajectory.speed).all()
    assert trajectory.scans is None


def test_negative_steps_of_the_table_are_those_of_the_trajectory(tmp_path: Path) -> None:
    recording = recorded()
    trajectories = resample(recording, profile=GENERIC, settings=IngestSettings())
    write_ingested(tmp_path, DESCRIPTION, recording, trajectories, cut_counts={})
    table = pd.read_parquet(tmp_path / "trajectories.parquet")
    expected = sum(int(np.count_nonzero(item.speed < 0)) for item in trajectories)
    assert table["negative_velocity"].sum() == expected > 50
