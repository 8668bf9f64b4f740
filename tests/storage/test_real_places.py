"""Places rebuilt from a real robot's log, against the map its owners made of the building."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

from ses_core.arrays import BoolArray, FloatArray
from ses_core.extraction.extract import ExtractedScenario, extract
from ses_core.extraction.reconstruction import scenario_frame
from ses_core.extraction.resampling import resample
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import Pose2D, from_frame
from ses_core.occupancy import ENVIRONMENT_RESOLUTION_M, environment_cell_centres
from ses_core.robot_profile import JACKAL, TURTLEBOT4
from ses_core.settings import DecoderLimits, ExtractionSettings, IngestSettings
from storage.rosbag_logs import RosbagLogReader
from tests.shared_data import shared_data

MAP_RESOLUTION = 0.03
MAP_CORNER = (-1.12, -39.4)
"""From the map's YAML file."""

ODOMETRY_IN_MAP = Pose2D(-0.447, -0.125, 0.0911)
"""Where the drive began in the map: the best match of all its scans, searched once over the map."""

NEAR = ENVIRONMENT_RESOLUTION_M


@cache
def drive(log: Path, workdir: Path) -> list[Trajectory]:
    reader = RosbagLogReader(limits=DecoderLimits(), workdir=workdir)
    recording = reader.read(log, profile=TURTLEBOT4, pose_source="odometry")
    return resample(recording, profile=TURTLEBOT4, settings=IngestSettings())


def places(trajectories: list[Trajectory]) -> list[ExtractedScenario]:
    return extract(
        trajectories,
        log_id="log",
        recorded_map=None,
        settings=ExtractionSettings(),
        profile=TURTLEBOT4,
        target=JACKAL,
    )


def in_map(place: ExtractedScenario, points: FloatArray) -> FloatArray:
    """Express points (N, 2) [m] of a scenario's frame in the map."""
    return from_frame(from_frame(points, scenario_frame(place.scenario)), ODOMETRY_IN_MAP)


def distances_to_walls(place: ExtractedScenario, walls: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Measure [m] from each wall cell to the map's walls, and from those in view to wall cells."""
    assert place.environment is not None
    cells = place.environment.cells
    offsets = (np.mgrid[-3:4, -3:4].reshape(2, -1).T / 6.0) * ENVIRONMENT_RESOLUTION_M
    samples = in_map(place, (environment_cell_centres()[:, :, None] + offsets).reshape(-1, 2))
    indices = np.floor((samples - MAP_CORNER) / MAP_RESOLUTION).astype(np.int64)
    from_walls = ndimage.distance_transform_edt(~walls) * MAP_RESOLUTION
    of_samples = from_walls[indices[:, 1], indices[:, 0]].reshape(30, 30, -1)
    nearest = of_samples.min(axis=2)
    from_cells = ndimage.distance_transform_edt(~cells) * ENVIRONMENT_RESOLUTION_M
    in_view = (nearest == 0.0) & place.environment.observed
    return nearest[cells], from_cells[in_view]


def map_walls() -> BoolArray:
    image = np.asarray(Image.open(shared_data("maps", "mac_1st_floor_final.pgm")).convert("L"))
    walls: BoolArray = (255.0 - image[::-1]) / 255.0 > 0.65
    return walls


def shares_near(trajectories: list[Trajectory], walls: BoolArray) -> tuple[float, float]:
    found = [
        distances_to_walls(place, walls) for place in places(trajectories) if place.environment
    ]
    to_map = np.concatenate([one for one, _ in found])
    to_cells = np.concatenate([one for _, one in found])
    return float((to_map <= NEAR).mean()), float((to_cells <= 1.5 * NEAR).mean())


def test_walls_of_the_turned_laser_lie_on_the_walls_of_the_map(tmp_path: Path) -> None:
    log = shared_data("logs", "ros2", "macfirst_floor_take_2")
    trajectories = drive(log, tmp_path)
    on_map, found = shares_near(trajectories, map_walls())
    # The rest is furniture that stood elsewhere when the map was made.
    assert on_map > 0.7
    assert found > 0.7

    unturned = [
        replace(one, scans=replace(one.scans, mount=Pose2D(0.0, 0.0)))
        for one in trajectories
        if one.scans is not None
    ]
    assert shares_near(unturned, map_walls())[0] < on_map - 0.2


def test_sqlite_and_mcap_give_identical_scenarios_and_places(tmp_path: Path) -> None:
    by_format = [
        places(drive(shared_data("logs", "ros2", name), tmp_path))
        for name in ("macfirst_floor_take_2", "macfirst_floor_take_2_mcap")
    ]
    assert len(by_format[0]) == len(by_format[1]) > 0
    for one, other in zip(*by_format, strict=True):
        assert one.scenario == other.scenario
        assert one.quality == other.quality
        assert one.environment is not None
        assert other.environment is not None
        assert one.environment.environment_id == other.environment.environment_id


def test_a_robot_that_lost_its_pose_is_told_by_its_scans(tmp_path: Path) -> None:
    found = places(drive(shared_data("logs", "ros1", "ksoltan_obstacle_avoid_demo.bag"), tmp_path))
    assert found[0].quality is not None
    assert found[0].quality.contradicted_fraction is not None
    assert found[0].quality.contradicted_fraction > 0.5
