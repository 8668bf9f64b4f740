"""Every imperfection does what it says, and nothing else; the presets stay what they are."""

import math

import numpy as np
import pytest

from ses_core.arrays import FloatArray
from ses_core.geometry import Pose2D
from ses_core.imperfections import PRESETS, REAL, Imperfections, resolve
from ses_core.occupancy import OccupancyGrid
from ses_core.robot_profile import JACKAL
from ses_core.simulation.batch import BatchSimulator
from ses_core.simulation.episode_start import draw_start, padded_outline
from tests.simulated import CLEAN, course, flawed, hall, parameters, simulator

MANY = 300


def _many(seconds: float, **levels: float) -> BatchSimulator:
    """Episodes in one long hall that differ in their seeds alone."""
    task = course(hall(length=20.0), goal=(18.0, 2.5))
    driven = simulator(*[task] * MANY, settings=flawed(**levels))
    driven.advance(parameters(MANY), round(20 * seconds))
    return driven


def _belief_errors(driven: BatchSimulator) -> FloatArray:
    return driven.state().odometry - driven.state().poses


def test_the_presets_are_frozen() -> None:
    assert set(PRESETS["clean"].model_dump().values()) == {0}
    assert PRESETS["real"] == REAL == Imperfections()
    for name, level in REAL.model_dump().items():
        assert getattr(PRESETS["double"], name) == 2 * level
        half = getattr(PRESETS["half"], name)
        assert half == (math.ceil(level / 2) if isinstance(level, int) else level / 2)
    assert resolve("half") is PRESETS["half"]
    own = Imperfections(range_noise_m=0.5)
    assert resolve(own) is own


def test_a_clean_robot_knows_where_it_is_to_the_last_bit() -> None:
    driven = _many(3.0)
    assert np.abs(_belief_errors(driven)).max() < 1e-12
    assert len(np.unique(driven.state().poses, axis=0)) == 1


def test_odometry_drifts_by_its_share_of_the_way() -> None:
    driven = _many(20.0, odometry_drift=0.02)
    errors, way = _belief_errors(driven), float(driven.state().path_lengths.mean())
    assert way > 9.0
    # The drive leads along x: the way's share is in x, the wander of the heading in yaw.
    assert np.std(errors[:, 0]) == pytest.approx(0.02 * way, rel=0.2)
    assert np.std(errors[:, 2]) == pytest.approx(0.02 * math.sqrt(way), rel=0.2)


def test_a_drifting_robot_steers_by_what_it_believes() -> None:
    driven = _many(20.0, odometry_drift=0.05)
    state = driven.state()
    # It keeps to y = 2.5 in its own frame, and its true path bends away as its heading wanders.
    assert np.std(state.odometry[:, 1]) < 0.5 * np.std(state.poses[:, 1])


def test_jitter_of_the_belief_has_its_deviations_and_does_not_add_up() -> None:
    errors = _belief_errors(_many(3.0, position_noise_m=0.03, heading_noise_rad=0.02))
    assert np.std(errors[:, :2]) == pytest.approx(0.03, rel=0.15)
    assert np.std(errors[:, 2]) == pytest.approx(0.02, rel=0.15)


def test_wheels_slip_by_their_episode_s_own_share_when_turning() -> None:
    task = course(hall(), start=Pose2D(4.0, 2.5, 2.5), goal=(8.0, 2.5))
    driven = simulator(*[task] * MANY, settings=flawed(turn_slip=0.1))
    driven.advance(parameters(MANY), 3)
    state = driven.state()
    ratio = state.velocities[:, 1] / state.commands[:, 1]
    assert np.all(state.commands[:, 0] == 0.0)
    assert np.std(ratio) == pytest.approx(0.1, rel=0.15)
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.02)


def test_wheel_noise_is_that_of_each_side() -> None:
    speeds = []
    driven = _many(2.0, wheel_noise=0.1)
    for _ in range(20):
        driven.advance(parameters(MANY), 1)
        speeds.append(driven.state().velocities[:, 0])
    # Both sides average: the deviation of their mean is 1 / sqrt(2) of one side's.
    assert np.std(speeds) / np.mean(speeds) == pytest.approx(0.1 / math.sqrt(2.0), rel=0.1)


def test_a_late_scan_shows_what_was_ahead_before() -> None:
    prompt, late = (
        simulator(course(hall())),
        simulator(course(hall()), settings=flawed(scan_delay_ticks=3)),
    )
    poses = [prompt.state().poses[0, 0]]
    for _ in range(40):
        for driven in (prompt, late):
            driven.advance(parameters(1), 1)
        poses.append(prompt.state().poses[0, 0])
    ahead = 360
    moved = poses[40] - poses[37]
    assert moved > 0.05
    assert late.scans()[0, ahead] - prompt.scans()[0, ahead] == pytest.approx(moved, abs=0.005)
    # It is put where the robot was then: what is marked are the faces of the walls.
    view = late.costmap(0)
    rows, columns = np.nonzero(view.costs == 254.0)
    x = view.origin[0] + (columns + 0.5) * view.resolution
    y = view.origin[1] + (rows + 0.5) * view.resolution
    faces = np.abs((x - 0.1, x - 8.9, y - 0.1, y - 4.9)).min(axis=0)
    assert len(faces) > 100
    assert faces.max() <= 0.5 * view.resolution + 1e-9


def test_starts_are_spread_over_a_disc_and_never_into_an_obstacle() -> None:
    levels = PRESETS["clean"].model_copy(update={"start_shift_m": 0.3, "start_turn_rad": 0.2})
    cells = hall()
    cells[:28, 9:12] = True
    task = course(cells, start=Pose2D(1.5, 3.15, 0.0))
    starts = [
        draw_start(task, profile=JACKAL, levels=levels, rng=np.random.default_rng(k)).pose
        for k in range(400)
    ]
    shifts = np.array([(start.x - 1.5, start.y - 3.15) for start in starts])
    assert np.hypot(*shifts.T).max() <= 0.3
    assert np.abs([start.yaw for start in starts]).max() <= 0.2
    assert np.std(shifts[:, 0]) == pytest.approx(0.15, rel=0.2)
    grid = OccupancyGrid(cells=cells, resolution=0.1)
    for start in starts:
        points = padded_outline(start, JACKAL)
        columns, rows = (points / grid.resolution).astype(int).T
        assert not cells[rows, columns].any()


def test_a_start_without_room_is_left_as_asked() -> None:
    cells = hall()
    cells[:] = True
    task = course(cells)
    assert (
        draw_start(task, profile=JACKAL, levels=REAL, rng=np.random.default_rng(0)).pose
        == task.start
    )


def test_a_known_map_begins_with_every_wall() -> None:
    cells = hall()
    cells[20:30, 60:62] = True
    settings = CLEAN.model_copy(update={"known_map": True})
    blind, knowing = simulator(course(cells)), simulator(course(cells), settings=settings)
    for driven, sees in ((blind, False), (knowing, True)):
        driven.plan_commands(parameters(1))
        view = driven.costmap(0)
        column = int((6.1 - view.origin[0]) / view.resolution)
        row = int((2.5 - view.origin[1]) / view.resolution)
        assert (view.costs[row, column] == 254.0) == sees
