"""A recorded episode is the evaluated one, and a moment of it shows what the robot had then."""

import numpy as np
import pytest

from ses_core.arrays import FloatArray
from ses_core.evaluation.episode_trace import (
    EpisodeTrace,
    look_at,
    record_episode,
    stretches,
    telling_time,
)
from ses_core.evaluation.places import sampled_places
from ses_core.evaluation.trials import evaluate
from ses_core.geometry import from_frame
from ses_core.imperfections import REAL
from ses_core.learning.observation import DEFAULT_OBSERVATION
from ses_core.learning.policies import FIXED_POLICIES, random_policy
from ses_core.navigation import NavigationTask
from ses_core.protocols import Policy
from ses_core.robot_profile import JACKAL
from ses_core.settings import EvaluationSettings, SimulationSettings
from ses_core.simulation.factory import SimulatorName
from ses_core.worlds.homes import generate_homes
from tests.ses_core.evaluation.traced import SIMULATION, drive, made_up
from tests.ses_core.learning.places import closed_room, corridor

PLACES = sampled_places(
    generate_homes(4, seed=4),
    settings=EvaluationSettings(pairs=3, seed=5, min_distance_m=5.0),
    profile=JACKAL,
)
LEARNED = random_policy(DEFAULT_OBSERVATION, (8,), rng=np.random.default_rng(0))


@pytest.mark.parametrize(
    ("task", "policy", "simulator"),
    [
        (corridor(), FIXED_POLICIES["dwa-slow"], "batch"),
        (corridor(), LEARNED, "batch"),
        (closed_room(), LEARNED, "batch"),
        (PLACES[1].task, FIXED_POLICIES["dwa-slow"], "batch"),
        (corridor(), LEARNED, "bullet"),
    ],
)
def test_a_trace_is_the_episode_of_the_evaluation(
    task: NavigationTask, policy: Policy, simulator: SimulatorName
) -> None:
    wanted = drive(task, policy=policy, simulator=simulator)
    evaluated = evaluate(
        {"driver": policy},
        [wanted.trial.place],
        trials=2,
        seed=3,
        simulation=SIMULATION,
        profile=JACKAL,
        simulator=simulator,
    )
    trace = record_episode(wanted)

    assert trace.episode == evaluated[1]
    assert trace.is_reversing.sum() == trace.episode.negative_velocity_count
    assert (trace.commands[1:, 0] <= 0.05).sum() == trace.episode.not_forward_count
    assert trace.times[-1] == trace.episode.time_s
    steps = np.diff(trace.poses[:, :2], axis=0)
    assert np.hypot(*steps.T).sum() == pytest.approx(trace.episode.path_length_m)
    away = trace.poses[0] - (task.start.x, task.start.y, task.start.yaw)
    assert np.hypot(*away[:2]) <= REAL.start_shift_m
    assert abs(away[2]) <= REAL.start_turn_rad


def backed_up() -> EpisodeTrace:
    """A drive that backs up more than once or twice; which one does hangs on every tick before."""
    for place in PLACES:
        trace = record_episode(drive(place.task))
        if trace.episode.negative_velocity_count > 20:
            return trace
    raise AssertionError("in no home a robot backed up")


def test_a_trace_tells_where_the_robot_reversed_and_stood() -> None:
    trace = backed_up()

    assert trace.reversing_s == pytest.approx(0.05 * trace.episode.negative_velocity_count)
    headings = np.column_stack((np.cos(trace.poses[:-1, 2]), np.sin(trace.poses[:-1, 2])))
    along = np.sum(np.diff(trace.poses[:, :2], axis=0) * headings, axis=1)
    long = [(first, end) for first, end in stretches(trace.is_reversing) if end - first > 5]
    assert long
    for first, end in long:
        assert along[first - 1 : end - 1].sum() < -0.05
    assert 0.0 < trace.standing_s < trace.times[-1]
    assert np.abs(trace.velocities[trace.is_standing, 0]).max() < 0.05


def test_parameters_change_once_a_second() -> None:
    trace = record_episode(drive(policy=LEARNED))
    changed = np.flatnonzero(np.any(np.diff(trace.parameters, axis=0) != 0.0, axis=1)) + 1
    assert len(changed) > 1
    assert set(changed % 20) == {0}


def test_a_moment_shows_what_the_robot_had_sensed_and_planned() -> None:
    calm = SimulationSettings(imperfections="clean")
    trace = record_episode(drive(simulation=calm))
    moment = look_at(trace, 3.33)

    assert moment.time == pytest.approx(3.2)
    np.testing.assert_array_equal(
        [moment.pose.x, moment.pose.y, moment.pose.yaw], trace.poses[round(3.2 / 0.05)]
    )
    assert moment.believed.x == pytest.approx(moment.pose.x)
    assert moment.believed.yaw == pytest.approx(moment.pose.yaw)
    grid = trace.drive.trial.place.task.world.grid
    points = from_frame(moment.scan, moment.pose)
    # A beam ends on the face of a wall cell, a little inside or in front of it.
    near = [_is_wall(grid.cells, points + 0.03 * np.array(step)) for step in _AROUND]
    assert np.mean(np.any(near, axis=0)) > 0.99
    rows, columns = np.nonzero(moment.costs == 254.0)
    marks = moment.origin + moment.resolution * (np.column_stack((columns, rows)) + 0.5)
    near = [_is_wall(grid.cells, marks + 0.05 * np.array(step)) for step in _AROUND]
    assert len(marks) > 20
    assert np.mean(np.any(near, axis=0)) > 0.99
    np.testing.assert_allclose(moment.plan[0], [moment.pose.x, moment.pose.y], atol=0.05)


_AROUND = [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)]


def _is_wall(
    cells: np.ndarray[tuple[int, ...], np.dtype[np.bool_]], points: FloatArray
) -> list[bool]:
    columns, rows = np.floor(points / 0.15).astype(int).T
    return [
        not (0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]) or bool(cells[row, column])
        for row, column in zip(rows, columns, strict=True)
    ]


def test_no_moment_lies_before_the_first_plan_or_outside_the_episode() -> None:
    trace = record_episode(drive())
    end = float(trace.times[-1])

    first = look_at(trace, 0.0)
    assert first.time == pytest.approx(0.2)
    assert first.costs.max() == 254.0
    assert end - 0.2 < look_at(trace, end).time <= end
    for time in (-0.1, end + 0.05):
        with pytest.raises(ValueError, match=f"found {time:g} s, expected 0 to {end:g} s"):
            look_at(trace, time)


def test_the_telling_moment_is_where_it_went_wrong() -> None:
    forward, back, still = np.full(100, 0.4), np.full(10, -0.1), np.zeros(30)
    drives = {
        "halfway": np.r_[forward, forward],
        "standing": np.r_[forward, still, forward],
        "reversing": np.r_[forward, still, back, forward, back, still[:5], back, forward],
    }
    times = {name: telling_time(made_up(speeds)) for name, speeds in drives.items()}

    assert times["halfway"] == pytest.approx(5.0)
    assert 5.0 < times["standing"] < 6.5
    # The second reversing is longer although it pauses: rows 241 to 265.
    assert 12.0 < times["reversing"] < 13.25
    assert telling_time(made_up(forward, outcome="collision")) == pytest.approx(4.6)


def test_stretches_are_runs_of_chosen_rows() -> None:
    chosen = np.array([0, 1, 1, 0, 1, 0, 0, 0, 1], dtype=np.bool_)
    assert stretches(chosen) == [(1, 3), (4, 5), (8, 9)]
    assert stretches(chosen, bridged=1) == [(1, 5), (8, 9)]
    assert stretches(chosen, bridged=3) == [(1, 9)]
    assert stretches(np.zeros(3, dtype=np.bool_)) == []
