"""What every simulator keeps: shapes, outcomes, seeds, and finished slots that stay as they are."""

from collections.abc import Callable
from dataclasses import astuple

import numpy as np

from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid
from ses_core.planning.parameters import DWA_SLOW
from ses_core.protocols import Simulator
from ses_core.simulation.trace import make_trace

SECOND = 20


def check_simulator(make: Callable[[int], Simulator], *, beams: int = 720) -> None:
    """Hold the seam's promises against what `make(slots)` makes with default settings."""
    _check_shapes(make(2), beams)
    _check_a_straight_drive(make(1))
    _check_what_the_robot_believes(make(1))
    _check_same_seed_same_bytes(make)
    _check_finished_slots_stay(make(2))
    _check_a_trace_is_what_was_seen_after_each_tick(make)


def _task(length: float = 3.0) -> NavigationTask:
    cells = np.zeros((40, 60), dtype=np.bool_)
    cells[[0, -1], :] = True
    cells[:, [0, -1]] = True
    grid = OccupancyGrid(cells=cells, resolution=0.1, origin=(-1.0, -2.0))
    world = World(world_id="open", grid=grid)
    return NavigationTask(world=world, start=Pose2D(0.0, 0.0, 0.0), goal=(length, 0.0))


def _parameters(simulator: Simulator) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.tile(DWA_SLOW.as_array(), (simulator.slots, 1))


def _check_shapes(simulator: Simulator, beams: int) -> None:
    simulator.reset(np.arange(2), [_task(), _task(2.5)], np.array([1, 2]))
    simulator.advance(_parameters(simulator), 3)
    assert simulator.slots == 2
    assert simulator.time_step == 0.05
    assert simulator.scans().shape == (2, beams)
    state = simulator.state()
    assert state.poses.shape == (2, 3)
    for pairs in (state.velocities, state.commands, state.goals, state.local_goals):
        assert pairs.shape == (2, 2)
    counts = (state.negative_counts, state.not_forward_counts)
    for singles in (state.path_lengths, *counts, state.outcomes):
        assert singles.shape == (2,)
    np.testing.assert_allclose(state.times, [0.15, 0.15])
    np.testing.assert_array_equal(state.goals, [[3.0, 0.0], [2.5, 0.0]])
    state.poses[:] = 99.0
    assert np.all(simulator.state().poses != 99.0)
    simulator.close()


def _check_a_straight_drive(simulator: Simulator) -> None:
    simulator.reset(np.arange(1), [_task()], np.array([3]))
    for _ in range(15):
        simulator.advance(_parameters(simulator), SECOND)
    state = simulator.state()
    assert state.outcomes.tolist() == [EpisodeOutcome.SUCCESS]
    assert 1.9 < state.path_lengths[0] < 2.2
    assert 4.0 < state.times[0] < 6.0
    assert state.negative_counts.tolist() == [0]
    np.testing.assert_allclose(state.poses[0], [2.0, 0.0, 0.0], atol=0.15)
    simulator.close()


def _check_what_the_robot_believes(simulator: Simulator) -> None:
    simulator.reset(np.arange(1), [_task()], np.array([3]))
    simulator.advance(_parameters(simulator), SECOND)
    costmap, plan = simulator.costmap(0), simulator.plan(0)
    assert costmap.costs.min() == 0.0
    assert costmap.costs.max() == 254.0
    row, _ = np.nonzero(costmap.costs == 254.0)
    # The sides of the hall: the wall cells nearest to it begin at y = -1.9 m and end at 1.9 m.
    assert abs(costmap.origin[1] + costmap.resolution * (row.min() + 0.5) + 1.9) < 0.15
    assert abs(costmap.origin[1] + costmap.resolution * (row.max() + 0.5) - 1.9) < 0.15
    np.testing.assert_allclose(plan[0], simulator.state().odometry[0, :2], atol=0.1)
    np.testing.assert_allclose(plan[-1], [3.0, 0.0], atol=0.1)
    simulator.close()


def _check_same_seed_same_bytes(make: Callable[[int], Simulator]) -> None:
    alone, twice, other = make(1), make(2), make(1)
    alone.reset(np.arange(1), [_task()], np.array([7]))
    twice.reset(np.array([1]), [_task()], np.array([7]))
    twice.reset(np.array([0]), [_task(2.0)], np.array([8]))
    other.reset(np.arange(1), [_task()], np.array([9]))
    for simulator in (alone, twice, other):
        simulator.advance(_parameters(simulator), 2 * SECOND)
    assert alone.scans()[0].tobytes() == twice.scans()[1].tobytes()
    assert alone.state().poses[0].tobytes() == twice.state().poses[1].tobytes()
    assert alone.state().poses[0].tobytes() != other.state().poses[0].tobytes()
    for simulator in (alone, twice, other):
        simulator.close()


def _check_finished_slots_stay(simulator: Simulator) -> None:
    simulator.reset(np.arange(2), [_task(1.05), _task()], np.array([1, 2]))
    simulator.advance(_parameters(simulator), SECOND)
    ended = simulator.state()
    assert ended.outcomes.tolist() == [EpisodeOutcome.SUCCESS, EpisodeOutcome.RUNNING]
    simulator.advance(_parameters(simulator), SECOND)
    later = simulator.state()
    for before, after in zip(_columns(ended), _columns(later), strict=True):
        np.testing.assert_array_equal(before[0], after[0])
    assert later.path_lengths[1] > ended.path_lengths[1]
    simulator.reset(np.array([0]), [_task()], np.array([1]))
    assert simulator.state().outcomes.tolist() == [EpisodeOutcome.RUNNING] * 2
    assert simulator.state().times[0] == 0.0
    assert simulator.state().times[1] == later.times[1]
    simulator.close()


def _columns(state: object) -> tuple[np.ndarray[tuple[int, ...], np.dtype[np.generic]], ...]:
    return astuple(state)  # type: ignore[call-overload]  # every simulator's state is a dataclass


def _check_a_trace_is_what_was_seen_after_each_tick(make: Callable[[int], Simulator]) -> None:
    ticks, sense_every = 3 * SECOND, 4
    seen, traced = make(2), make(2)
    beams = seen.scans().shape[1]
    trace = make_trace(2, ticks=ticks, sense_every=sense_every, beams=beams)
    traced.trace_into(trace)
    for simulator in (seen, traced):
        simulator.reset(np.arange(2), [_task(), _task(1.3)], np.array([1, 2]))
    traced.advance(_parameters(traced), ticks)
    for row in range(ticks + 1):
        state = seen.state()
        moved = np.rint(state.times / seen.time_step) == row
        for name in ("poses", "odometry", "velocities", "commands"):
            expected = getattr(state, name)[moved]
            np.testing.assert_array_equal(getattr(trace, name)[moved, row], expected, name)
        if row % sense_every == 0:
            scans = seen.scans()[moved]
            np.testing.assert_array_equal(trace.scans[moved, row // sense_every], scans)
        seen.advance(_parameters(seen), 1)
    # The second one has arrived by then, and stays as it ended.
    assert not moved[1]
    for simulator in (seen, traced):
        simulator.close()
