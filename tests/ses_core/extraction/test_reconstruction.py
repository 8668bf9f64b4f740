"""Places rebuilt from scans and maps, against the walls they were made of."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ses_core.arrays import BoolArray, FloatArray
from ses_core.extraction.reconstruction import (
    Reconstruction,
    driven_path,
    reconstruct,
    scans_of,
    scenario_frame,
)
from ses_core.extraction.recording import RecordedMap, ScanStream
from ses_core.extraction.segmentation import segment
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import Pose2D, inverse
from ses_core.occupancy import ENVIRONMENT_RESOLUTION_M, environment_cell_centres
from ses_core.settings import ExtractionSettings
from tests.ses_core.extraction.drives import CORRIDOR, STEP_NS, drive_along, scanned_drive, straight

SETTINGS = ExtractionSettings()
BODY_RADIUS = 0.165


def rebuild(
    trajectory: Trajectory,
    *,
    recorded_map: RecordedMap | None = None,
    settings: ExtractionSettings = SETTINGS,
    body_radius: float = BODY_RADIUS,
) -> Reconstruction | None:
    scenario = segment(trajectory, settings=settings)[0]
    return reconstruct(
        trajectory,
        scenario,
        recorded_map=recorded_map,
        settings=settings,
        body_radius=body_radius,
    )


def rebuilt(trajectory: Trajectory, **options: object) -> Reconstruction:
    place = rebuild(trajectory, **options)  # type: ignore[arg-type]  # passed through unchanged
    assert place is not None
    return place


def cells_with_wall(walls: FloatArray, *, spacing: float = 0.002) -> BoolArray:
    """Mark the cells of the scenario's frame that points along the walls lie in."""
    cells = np.zeros((30, 30), dtype=np.bool_)
    for x0, y0, x1, y1 in walls:
        count = math.ceil(math.hypot(x1 - x0, y1 - y0) / spacing) + 1
        x, y = np.linspace(x0, x1, count), np.linspace(y0, y1, count)
        rows = 29 - np.floor(x / ENVIRONMENT_RESOLUTION_M).astype(int)
        columns = 14 - np.floor(y / ENVIRONMENT_RESOLUTION_M).astype(int)
        inside = (rows >= 0) & (rows < 30) & (columns >= 0) & (columns < 30)
        cells[rows[inside], columns[inside]] = True
    return cells


def grown(cells: BoolArray) -> BoolArray:
    padded = np.pad(cells, 1)
    return np.logical_or.reduce(
        [padded[1 + r : 31 + r, 1 + c : 31 + c] for r in (-1, 0, 1) for c in (-1, 0, 1)]
    )


def test_a_corridor_with_a_pillar_comes_back_cell_by_cell() -> None:
    place = rebuilt(scanned_drive(straight(6.0), CORRIDOR))
    truth = cells_with_wall(CORRIDOR)
    # Walls lie on borders between cells here: their cell may be either one.
    assert (place.cells & ~grown(truth)).sum() == 0
    assert (truth & ~grown(place.cells)).sum() == 0
    assert place.cells[:, 7:9].any(axis=1).all()
    assert place.cells[:, 20:22].any(axis=1).all()
    assert place.path_in_free_fraction == 1.0
    assert place.overridden_cells == 0
    assert place.contradicted_fraction == pytest.approx(0.0, abs=0.02)


def test_what_lies_behind_walls_is_unseen_and_resolved_by_the_setting() -> None:
    trajectory = scanned_drive(straight(6.0), CORRIDOR)
    as_free = rebuilt(trajectory)
    as_occupied = rebuilt(trajectory, settings=ExtractionSettings(unknown="occupied"))
    behind = np.abs(environment_cell_centres()[..., 1]) > 1.0 + ENVIRONMENT_RESOLUTION_M
    assert not as_free.observed[behind].any()
    assert not as_free.cells[behind].any()
    assert as_occupied.cells[behind].all()
    assert (as_occupied.observed == as_free.observed).all()
    in_between = np.abs(environment_cell_centres()[..., 1]) < 0.3
    assert as_free.observed[in_between].all()


@settings(max_examples=10, deadline=None)
@given(
    st.floats(-math.pi, math.pi),
    st.floats(-500.0, 500.0),
    st.floats(-500.0, 500.0),
)
def test_turning_and_shifting_the_world_leaves_the_place_unchanged(
    yaw: float, x: float, y: float
) -> None:
    # Off the borders between cells, where rounding would decide.
    walls = CORRIDOR + np.array([0.013, 0.031, 0.013, 0.031])
    here = rebuilt(scanned_drive(straight(6.0), walls, beams=240, every=8))
    there = rebuilt(
        scanned_drive(straight(6.0), walls, beams=240, every=8, frame=Pose2D(x, y, yaw))
    )
    assert (here.cells != there.cells).sum() <= 2
    assert (here.observed != there.observed).sum() <= 4


@pytest.mark.parametrize("mount", [Pose2D(0.2, -0.1, 0.0), Pose2D(0.0, 0.0, math.pi / 2)])
def test_a_laser_mounted_ahead_or_turned_sees_the_same_place(mount: Pose2D) -> None:
    place = rebuilt(scanned_drive(straight(6.0), CORRIDOR, mount=mount))
    truth = cells_with_wall(CORRIDOR)
    assert (place.cells & ~grown(truth)).sum() == 0
    assert (truth & ~grown(place.cells)).sum() == 0


@settings(max_examples=15, deadline=None)
@given(st.floats(0.0, math.pi), st.floats(1.2, 2.2), st.floats(1.2, 3.8))
def test_a_thin_wall_at_any_angle_does_not_leak(angle: float, offset: float, along: float) -> None:
    middle = np.array([along, offset])
    half = 0.6 * np.array([math.cos(angle), math.sin(angle)])
    wall = np.concatenate((middle - half, middle + half))[None]
    place = rebuilt(scanned_drive(straight(6.0), wall, every=8))
    truth = cells_with_wall(wall)
    # Every bit of wall lies in an occupied cell or, within the accuracy of a beam, beside one.
    assert (truth & ~grown(place.cells)).sum() == 0
    assert (truth & place.cells).sum() >= 0.8 * truth.sum()


def test_someone_walking_by_is_not_part_of_the_place() -> None:
    trajectory = scanned_drive(straight(6.0), CORRIDOR)
    assert trajectory.scans is not None
    ranges = trajectory.scans.ranges
    for scan in range(12):
        ahead = slice(350 + scan, 370 + scan)
        ranges[scan, ahead] = np.minimum(ranges[scan, ahead], 2.0 + 0.1 * scan)
    place = rebuilt(trajectory)
    empty = np.abs(environment_cell_centres()[..., 1]) < 0.3
    assert not place.cells[empty].any()


def test_lost_readings_do_not_wear_walls_away() -> None:
    rng = np.random.default_rng(0)
    place = rebuilt(scanned_drive(straight(6.0), CORRIDOR, lost=rng.random(720) < 0.7))
    assert place.cells[:, 7:9].any(axis=1).mean() > 0.95
    assert place.cells[:, 20:22].any(axis=1).mean() > 0.95


def test_the_path_frees_what_the_robot_drove_through_and_this_is_counted() -> None:
    across = np.concatenate((CORRIDOR, [[2.55, -0.05, 2.55, 0.05]]))
    trajectory = scanned_drive(straight(6.0), across)
    place = rebuilt(trajectory)
    on_path = np.abs(environment_cell_centres()[..., 1]) < 0.1
    assert not place.cells[on_path].any()
    assert place.overridden_cells >= 1
    assert 0.9 < place.path_in_free_fraction < 1.0


def test_leaving_the_window_sideways_lowers_the_share_of_free_path() -> None:
    detour = np.array([[0.0, 0.0], [1.0, 3.2], [3.0, 3.2], [5.2, 0.0]])
    steps = [np.linspace(start, end, 100, endpoint=False) for start, end in pairwise(detour)]
    far_away = np.array([[-20.0, -20.0, 20.0, -20.0]])
    place = rebuilt(scanned_drive(np.concatenate([*steps, detour[-1:]]), far_away, range_max=60.0))
    assert not place.cells.any()
    assert 0.3 < place.path_in_free_fraction < 0.8


def test_scans_that_contradict_each_other_are_told_apart_from_walls() -> None:
    good = scanned_drive(straight(6.0), CORRIDOR)
    assert good.scan_poses is not None
    rng = np.random.default_rng(0)
    good.scan_poses[:, 2] += rng.uniform(-math.pi, math.pi, len(good.scan_poses))
    lost = rebuilt(good)
    assert lost.contradicted_fraction is not None
    assert lost.contradicted_fraction > 0.6


def test_one_hit_is_a_wall_only_where_no_beam_looked_through() -> None:
    # From one spot, the first scan reads something at 1.5 m and the second looks past it.
    trajectory = drive_along(
        straight(5.1),
        scans=ScanStream(
            stamps_ns=np.array([0, STEP_NS]),
            ranges=np.array([[1.5], [2.6]], dtype=np.float32),
            angles=np.array([0.5]),
            range_max=30.0,
            mount=Pose2D(0.0, 0.0),
        ),
        scan_poses=np.zeros((2, 3)),
    )
    end = 2.6 * np.array([math.cos(0.5), math.sin(0.5)])
    place = rebuilt(trajectory)
    assert place.cells.sum() == 1
    assert place.cells[
        29 - math.floor(end[0] / ENVIRONMENT_RESOLUTION_M),
        14 - math.floor(end[1] / ENVIRONMENT_RESOLUTION_M),
    ]


def test_only_scans_within_the_margin_count() -> None:
    trajectory = scanned_drive(straight(12.0), CORRIDOR, every=1)
    scenarios = segment(trajectory, settings=SETTINGS)
    chosen = scans_of(trajectory, scenarios[1], margin=1.0)
    assert chosen == slice(scenarios[1].first_step - 20, scenarios[1].last_step + 20 + 1)
    assert scans_of(trajectory, scenarios[0], margin=0.0).start == 0


def test_without_scans_or_map_there_is_no_place() -> None:
    trajectory = scanned_drive(straight(6.0), CORRIDOR)
    assert rebuild(trajectory, settings=ExtractionSettings(source="map")) is None
    nothing = np.array([[100.0, 100.0, 101.0, 100.0]])
    blind = scanned_drive(straight(6.0), nothing, range_max=0.01)
    seen = rebuild(blind)
    assert seen is None or seen.observed.mean() < 0.1


def drawn_map(frame: Pose2D, *, resolution: float) -> RecordedMap:
    """Draw the corridor into a map whose own frame is given in the world."""
    cells = np.full((round(4.0 / resolution), round(14.0 / resolution)), 0, dtype=np.uint8)
    y, x = np.mgrid[: cells.shape[0], : cells.shape[1]] * resolution + resolution / 2
    x, y = x - 4.0, y - 2.0
    cells[np.abs(np.abs(y) - 1.05) < 0.051] = 1
    cells[(np.abs(x - 2.5) < 0.2) & (np.abs(y - 0.6) < 0.2)] = 1
    cells[np.abs(y) > 1.3] = 2
    corner = Pose2D(-4.0, -2.0, 0.0)
    cosine, sine = math.cos(frame.yaw), math.sin(frame.yaw)
    origin = Pose2D(
        frame.x + cosine * corner.x - sine * corner.y,
        frame.y + sine * corner.x + cosine * corner.y,
        frame.yaw,
    )
    return RecordedMap(cells=cells, resolution=resolution, origin=origin)


@pytest.mark.parametrize("resolution", [0.02, 0.05])
@pytest.mark.parametrize("frame", [Pose2D(0.0, 0.0, 0.0), Pose2D(30.0, -12.0, 2.1)])
def test_a_place_from_a_map_has_the_walls_of_the_map(frame: Pose2D, resolution: float) -> None:
    trajectory = scanned_drive(straight(6.0), CORRIDOR, frame=frame)
    place = rebuilt(trajectory, recorded_map=drawn_map(frame, resolution=resolution))
    centres = environment_cell_centres()
    half = ENVIRONMENT_RESOLUTION_M / 2
    across = np.abs(centres[..., 1])
    # Occupied where the cell overlaps a wall by more than one map cell.
    in_wall = (across + half > 1.0 + resolution) & (across - half < 1.1 - resolution)
    clear = (across + half < 1.0 - resolution) & (np.abs(centres[..., 0] - 2.5) > 0.4)
    assert place.origin == "map"
    assert place.contradicted_fraction is None
    assert place.cells[in_wall].all()
    assert not place.cells[clear].any()
    assert not place.observed[across > 1.5].any()


def test_a_map_wins_over_scans_unless_the_setting_says_otherwise() -> None:
    trajectory = scanned_drive(straight(6.0), CORRIDOR)
    recorded_map = drawn_map(Pose2D(0.0, 0.0), resolution=0.05)
    assert rebuilt(trajectory, recorded_map=recorded_map).origin == "map"
    by_scan = rebuilt(
        trajectory, recorded_map=recorded_map, settings=ExtractionSettings(source="scan")
    )
    assert by_scan.origin == "scan"


def test_the_driven_path_runs_from_the_origin_to_beyond_the_top_edge() -> None:
    trajectory = scanned_drive(straight(6.0), CORRIDOR, frame=Pose2D(7.0, 8.0, 1.0))
    scenario = segment(trajectory, settings=SETTINGS)[0]
    path = driven_path(trajectory, scenario)
    assert np.allclose(path[0], 0.0, atol=1e-9)
    assert path[-1] == pytest.approx([math.dist((7.0, 8.0), scenario.goal), 0.0], abs=1e-9)
    assert path[-1, 0] > 5.0
    steps = np.hypot(*np.diff(path, axis=0).T)
    assert steps.max() < 0.025
    assert inverse(scenario_frame(scenario)).yaw == pytest.approx(-1.0)
