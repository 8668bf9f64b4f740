import math
from collections.abc import Iterator

import numpy as np
import pytest

from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.planning.parameters import DWA_SLOW
from ses_core.robot_profile import JACKAL, TURTLEBOT4, RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.bullet import BulletSimulator, PhysicalSlot
from ses_core.simulation.rendering import render
from tests.contracts.simulator import check_simulator
from tests.simulated import flawed

CALM = SimulationSettings(imperfections="clean")
PARAMETERS = DWA_SLOW.as_array()


def _hall(*, length: int = 60, wall_at: int | None = None) -> OccupancyGrid:
    """A hall 3 m wide, with a wall right across it if asked for."""
    cells = np.zeros((30, length), dtype=np.bool_)
    if wall_at is not None:
        cells[:, wall_at] = True
    return OccupancyGrid(cells=cells, resolution=0.1, origin=(-1.0, -1.5))


def _task(grid: OccupancyGrid, *, goal: float = 3.5) -> NavigationTask:
    return NavigationTask(
        world=World(world_id="hall", grid=grid), start=Pose2D(0.0, 0.0), goal=(goal, 0.0)
    )


@pytest.fixture
def slot() -> Iterator[PhysicalSlot]:
    physical = PhysicalSlot(JACKAL, time_step=1 / 240)
    yield physical
    physical.close()


def _drive(slot: PhysicalSlot, v: float, w: float, seconds: float) -> list[bool]:
    command = np.array([v, w])
    return [slot.drive(command, substeps=12) for _ in range(round(seconds * 20))]


@pytest.mark.parametrize(
    ("v", "w"),
    [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, 1.57), (0.5, 0.5), (0.5, -1.0), (1.0, 0.3)],
)
def test_two_seconds_open_loop_end_where_a_unicycle_does(
    slot: PhysicalSlot, v: float, w: float
) -> None:
    open_ground = OccupancyGrid(cells=np.zeros((100, 100), np.bool_), resolution=0.1)
    slot.build(render(open_ground), Pose2D(5.0, 5.0))
    assert not any(_drive(slot, v, w, 2.0))
    x, y, yaw = slot.pose()
    turned = 2.0 * w
    expected = (v / w * math.sin(turned), v / w * (1 - math.cos(turned))) if w else (2.0 * v, 0.0)
    assert math.hypot(x - 5.0 - expected[0], y - 5.0 - expected[1]) < 0.06
    assert abs(math.remainder(yaw - turned, 2 * math.pi)) < 0.06 + 0.1 * abs(turned)


def test_a_robot_driven_at_a_wall_touches_it_and_stays_out(slot: PhysicalSlot) -> None:
    slot.build(render(_hall(wall_at=30)), Pose2D(0.0, 0.0))
    touched = _drive(slot, 0.5, 0.0, 6.0)
    # The wall begins at 2.0 m and the body reaches 0.21 m ahead of its centre.
    first = touched.index(True)
    assert first * 0.05 == pytest.approx(1.79 / 0.5, abs=0.2)
    assert slot.pose()[0] < 1.85


def test_wheels_pass_where_the_body_does(slot: PhysicalSlot) -> None:
    # A slit 0.4 m wide: the body is 0.33 m wide, the Jackal with its wheels 0.416 m.
    cells = np.zeros((31, 60), dtype=np.bool_)
    cells[:, 20:40] = True
    cells[12:16, 20:40] = False
    slot.build(
        render(OccupancyGrid(cells=cells, resolution=0.1, origin=(-1.0, -1.4))), Pose2D(0.0, 0.0)
    )
    assert not any(_drive(slot, 0.5, 0.0, 4.0))
    assert slot.pose()[0] > 1.8


def _simulate(
    tasks: list[NavigationTask],
    *,
    settings: SimulationSettings = CALM,
    profile: RobotProfile = JACKAL,
    seconds: int = 15,
) -> BulletSimulator:
    simulator = BulletSimulator(slots=len(tasks), profile=profile, settings=settings)
    simulator.reset(np.arange(len(tasks)), tasks, np.arange(len(tasks)))
    simulator.advance(np.tile(PARAMETERS, (len(tasks), 1)), seconds * 20)
    return simulator


def test_it_keeps_the_promises_of_the_seam() -> None:
    check_simulator(
        lambda slots: BulletSimulator(slots=slots, profile=JACKAL, settings=SimulationSettings())
    )


def test_robots_drive_through_a_hall_to_the_goal() -> None:
    for profile in (JACKAL, TURTLEBOT4):
        simulator = _simulate([_task(_hall())], profile=profile)
        state = simulator.state()
        assert state.outcomes.tolist() == [EpisodeOutcome.SUCCESS]
        assert 4.0 < state.times[0] < 10.0
        assert state.poses[0, 0] == pytest.approx(2.5, abs=0.1)
        simulator.close()


def test_same_seed_same_drive_whatever_the_other_slots() -> None:
    noisy = flawed(wheel_noise=0.1)
    alone = _simulate([_task(_hall())], settings=noisy, seconds=3)
    among = _simulate([_task(_hall()), _task(_hall(length=70))], settings=noisy, seconds=3)
    assert alone.state().poses[0].tolist() == among.state().poses[0].tolist()
    assert alone.scans()[0].tobytes() == among.scans()[0].tobytes()
    clean = _simulate([_task(_hall())], seconds=3)
    assert alone.state().poses[0].tolist() != clean.state().poses[0].tolist()
    for simulator in (alone, among, clean):
        simulator.close()


def test_a_slot_starts_afresh_after_an_episode_in_another_world() -> None:
    simulator = _simulate([_task(_hall(wall_at=30))], seconds=3)
    simulator.reset(np.array([0]), [_task(_hall())], np.array([0]))
    simulator.advance(PARAMETERS[None], 200)
    fresh = _simulate([_task(_hall())], seconds=10)
    assert simulator.state().poses.tolist() == fresh.state().poses.tolist()
    simulator.close()
    fresh.close()


def test_a_still_shows_robot_and_walls() -> None:
    simulator = _simulate([_task(_hall(wall_at=30))], seconds=1)
    picture = simulator.still(0, width=160, height=120).astype(np.int64)
    assert picture.shape == (120, 160, 3)
    yellow = (picture[..., 0] > 150) & (picture[..., 2] < 80)
    walls = (np.ptp(picture, axis=2) > 8) & (picture[..., 0] > picture[..., 2]) & ~yellow
    assert yellow.mean() > 0.003
    assert walls.mean() > 0.1
    simulator.close()


def test_a_slot_without_an_episode_has_no_picture() -> None:
    simulator = BulletSimulator(slots=1, profile=JACKAL, settings=CALM)
    with pytest.raises(ValueError, match="slot 0 has no episode"):
        simulator.still(0)
    simulator.close()
