"""Whole episodes: what the stack does in a world, and that it is repeatable."""

import numpy as np
import pytest

from ses_core.arrays import BoolArray
from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.geometry import Pose2D
from ses_core.planning.parameters import DWA_FAST, DWA_SLOW
from ses_core.robot_profile import JACKAL, TURTLEBOT4, LaserProfile
from ses_core.settings import SimulationSettings
from ses_core.simulation.batch import BatchSimulator
from ses_core.simulation.trace import make_trace
from tests.contracts.simulator import check_simulator
from tests.simulated import CLEAN, course, drive_out, flawed, hall, kernel, parameters, simulator

BLIND = JACKAL.model_copy(update={"laser": LaserProfile(range_max_m=0.11)})


def _wall_with_gap(width: float) -> BoolArray:
    cells = hall(resolution=0.05)
    cells[:, 70:73] = True
    half = round(width / 0.1)
    cells[50 - half : 50 + half, 70:73] = False
    return cells


def _dead_end() -> BoolArray:
    """A pocket that opens towards the robot; the way round is past either of its arms."""
    cells = hall()
    cells[18:20, 15:45] = True
    cells[31:33, 15:45] = True
    cells[18:33, 43:45] = True
    return cells


def test_it_keeps_the_contract() -> None:
    check_simulator(
        lambda slots: BatchSimulator(slots=slots, profile=JACKAL, settings=SimulationSettings())
    )


def test_an_open_world_is_crossed_straight() -> None:
    driven = simulator(course(hall()))
    drive_out(driven)
    state = driven.state()
    assert state.outcomes.tolist() == [EpisodeOutcome.SUCCESS]
    assert state.path_lengths[0] == pytest.approx(6.0, abs=0.1)
    assert state.times[0] == pytest.approx(12.0, abs=0.5)
    assert abs(state.poses[0, 1] - 2.5) < 0.1


def test_dwa_fast_is_fast() -> None:
    driven = simulator(course(hall()))
    drive_out(driven, DWA_FAST)
    assert driven.state().times[0] == pytest.approx(6.1, abs=0.5)


def test_a_round_robot_with_a_laser_all_round_drives_too() -> None:
    driven = simulator(course(_wall_with_gap(1.6), resolution=0.05), profile=TURTLEBOT4)
    drive_out(driven)
    assert driven.state().outcomes.tolist() == [EpisodeOutcome.SUCCESS]
    assert driven.state().velocities[0, 0] <= 0.46 + 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_a_gap_of_1_2_m_is_passed(seed: int) -> None:
    task = course(_wall_with_gap(1.2), resolution=0.05)
    driven = simulator(task, settings=SimulationSettings(), seed=seed)
    drive_out(driven)
    assert driven.state().outcomes.tolist() == [EpisodeOutcome.SUCCESS]


def test_a_gap_narrower_than_the_robot_is_not_passed() -> None:
    driven = simulator(course(_wall_with_gap(0.4), resolution=0.05))
    drive_out(driven)
    assert driven.state().outcomes[0] != EpisodeOutcome.SUCCESS
    assert driven.state().poses[0, 0] < 3.5


def test_a_dead_end_makes_the_robot_back_up_or_stick() -> None:
    tasks = [course(_dead_end(), start=Pose2D(1.0, y, 0.0)) for y in (2.4, 2.5, 2.6)]
    driven = simulator(*tasks, settings=SimulationSettings())
    drive_out(driven)
    state = driven.state()
    assert np.any(state.negative_counts > 20)
    assert np.all(state.not_forward_counts >= state.negative_counts)
    # Straight through would be 6 m: whoever arrived went in, out and round.
    has_arrived = state.outcomes == EpisodeOutcome.SUCCESS
    assert np.all(state.path_lengths[has_arrived] > 7.0)
    assert np.all(state.times[~has_arrived] >= 40.0)


def test_driving_blind_into_a_wall_is_a_collision_at_its_face() -> None:
    cells = hall()
    cells[:, 40:] = True
    driven = simulator(course(cells), profile=BLIND)
    drive_out(driven)
    state = driven.state()
    assert state.outcomes.tolist() == [EpisodeOutcome.COLLISION]
    # The bumper is 0.21 m ahead of the centre; the body is tested every 2 cm at most.
    assert 4.0 - 0.21 - 0.03 <= state.poses[0, 0] <= 4.0 - 0.21
    assert state.contact_counts.tolist() == [1]


def test_by_setting_contact_only_blocks_and_the_episode_ends_as_stuck() -> None:
    cells = hall()
    cells[:, 40:] = True
    settings = CLEAN.model_copy(update={"collisions_end": False})
    driven = simulator(course(cells), profile=BLIND, settings=settings)
    drive_out(driven)
    state = driven.state()
    assert state.outcomes.tolist() == [EpisodeOutcome.STUCK]
    assert state.contact_counts[0] > 100
    assert state.poses[0, 0] <= 4.0 - 0.21


def test_a_robot_in_contact_can_back_off() -> None:
    cells = hall()
    cells[:, 40:] = True
    settings = CLEAN.model_copy(update={"collisions_end": False})
    driven = simulator(course(cells), profile=BLIND, settings=settings)
    driven.advance(parameters(1), 300)
    touching = driven.state()
    assert touching.contact_counts[0] > 0
    # The same place, seen: the stack finds no legal sample and reverses.
    seeing = simulator(course(cells, start=Pose2D(*touching.poses[0].tolist())), settings=settings)
    seeing.advance(parameters(1), 40)
    assert seeing.state().poses[0, 0] < touching.poses[0, 0] - 0.1
    assert seeing.state().negative_counts[0] > 0


def test_the_clock_ends_an_episode() -> None:
    settings = CLEAN.model_copy(update={"time_limit_s": 2.0})
    driven = simulator(course(hall()), settings=settings)
    drive_out(driven)
    assert driven.state().outcomes.tolist() == [EpisodeOutcome.TIMEOUT]
    assert driven.state().times.tolist() == [2.0]


def test_same_seeds_give_the_same_bytes_whatever_the_batch_and_the_threads(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tasks = [course(_dead_end(), start=Pose2D(1.0, 2.2 + 0.1 * k, 0.0)) for k in range(5)]
    together = simulator(*tasks, settings=SimulationSettings())
    monkeypatch.setattr("numba.get_num_threads", lambda: 1)
    one_thread = simulator(*tasks, settings=SimulationSettings())
    together.advance(parameters(5), 200)
    one_thread.advance(parameters(5), 200)
    assert together._slots.tobytes() == one_thread._slots.tobytes()
    assert together.scans().tobytes() == one_thread.scans().tobytes()
    alone = BatchSimulator(slots=1, profile=JACKAL, settings=SimulationSettings())
    alone.reset(np.array([0]), [tasks[3]], np.array([3]))
    for _ in range(20):
        alone.advance(parameters(1), 10)
    assert alone.state().poses[0].tobytes() == together.state().poses[3].tobytes()
    assert alone.scans()[0].tobytes() == together.scans()[3].tobytes()


def test_another_seed_gives_another_drive_and_no_noise_gives_none() -> None:
    task = course(_wall_with_gap(1.2), resolution=0.05)
    noisy = simulator(task, task, settings=SimulationSettings())
    clean = simulator(task, task)
    for driven in (noisy, clean):
        driven.advance(parameters(2), 60)
    assert noisy.state().poses[0].tobytes() != noisy.state().poses[1].tobytes()
    assert clean.state().poses[0].tobytes() == clean.state().poses[1].tobytes()


def test_a_slot_of_a_used_simulator_starts_as_in_a_new_one() -> None:
    used = simulator(course(_dead_end()), settings=SimulationSettings())
    used.advance(parameters(1), 150)
    large = np.pad(hall(), 40)
    for task in (course(large, resolution=0.1, start=Pose2D(6.0, 6.5)), course(hall())):
        used.reset(np.array([0]), [task], np.array([0]))
        new = simulator(task, settings=SimulationSettings())
        for driven in (used, new):
            driven.advance(parameters(1), 60)
        assert used.state().poses.tobytes() == new.state().poses.tobytes()
        assert used.scans().tobytes() == new.scans().tobytes()


def test_what_other_slots_have_seen_survives_a_reset_that_needs_more_room() -> None:
    pair = simulator(course(_dead_end()), course(hall()))
    lone = simulator(course(_dead_end()))
    pair.advance(parameters(2), 60)
    lone.advance(parameters(1), 60)
    large = np.pad(hall(), 60)
    pair.reset(np.array([1]), [course(large, start=Pose2D(7.0, 8.5))], np.array([5]))
    pair.advance(parameters(2), 60)
    lone.advance(parameters(1), 60)
    assert pair.state().poses[0].tobytes() == lone.state().poses[0].tobytes()
    np.testing.assert_array_equal(pair.costmap(0).costs, lone.costmap(0).costs)


def test_planning_and_settling_tick_by_tick_is_advancing() -> None:
    whole, split = simulator(course(_dead_end())), simulator(course(_dead_end()))
    before = np.zeros(1, dtype=np.int64)
    for _ in range(200):
        whole.advance(parameters(1), 1)
        moved = whole.state()
        split.plan_commands(parameters(1))
        split.settle(moved.poses, moved.velocities, moved.contact_counts > before)
        before = moved.contact_counts
    after = split.state()
    np.testing.assert_array_equal(after.commands, whole.state().commands)
    np.testing.assert_array_equal(after.negative_counts, whole.state().negative_counts)
    np.testing.assert_array_equal(after.not_forward_counts, whole.state().not_forward_counts)
    np.testing.assert_array_equal(after.times, whole.state().times)
    np.testing.assert_array_equal(split.scans(), whole.scans())


def test_a_command_takes_effect_after_its_delay() -> None:
    settings = flawed(command_delay_ticks=2)
    driven = simulator(course(hall()), settings=settings)
    speeds = []
    for _ in range(4):
        driven.advance(parameters(1), 1)
        speeds.append(float(driven.state().velocities[0, 0]))
    assert speeds == pytest.approx([0.0, 0.0, 0.5, 0.5])


def test_dropped_readings_are_lost_at_their_share() -> None:
    settings = flawed(range_dropout=0.3)
    driven = simulator(course(hall()), settings=settings)
    assert np.mean(np.isinf(driven.scans())) == pytest.approx(0.3, abs=0.06)


def test_readings_are_noisy_by_the_setting() -> None:
    settings = flawed(range_noise_m=0.02)
    difference = (
        simulator(course(hall()), settings=settings).scans() - simulator(course(hall())).scans()
    )
    assert np.std(difference) == pytest.approx(0.02, rel=0.15)


def test_slots_without_an_episode_do_nothing() -> None:
    driven = BatchSimulator(slots=3, profile=JACKAL, settings=CLEAN)
    driven.reset(np.array([1]), [course(hall())], np.array([0]))
    driven.advance(parameters(3), 20)
    assert driven.state().path_lengths.tolist() == [0.0, driven.state().path_lengths[1], 0.0]
    assert driven.state().path_lengths[1] > 0.4


def test_misuse_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match="0 slots, expected at least 1"):
        BatchSimulator(slots=0, profile=JACKAL, settings=CLEAN)
    driven = simulator(course(hall()))
    with pytest.raises(ValueError, match="got 1 tasks and 2 seeds"):
        driven.reset(np.array([0]), [course(hall())], np.array([0, 1]))
    with pytest.raises(ValueError, match="slot 4"):
        driven.reset(np.array([4]), [course(hall())], np.array([0]))
    with pytest.raises(ValueError, match=r"\(1, 6\), expected \(1, 8\)"):
        driven.advance(np.zeros((1, 6)), 1)
    for slots, sense_every, beams in ((2, 4, 720), (1, 5, 720), (1, 4, 360)):
        trace = make_trace(slots, ticks=100, sense_every=sense_every, beams=beams)
        with pytest.raises(ValueError, match=r"expected \(1, 26, 720\)"):
            driven.trace_into(trace)


def test_the_map_grows_with_what_the_robot_sees() -> None:
    driven = simulator(course(_wall_with_gap(1.2), resolution=0.05))
    seen = np.count_nonzero(kernel(driven).memory.marks)
    driven.advance(parameters(1, DWA_SLOW), 100)
    assert np.count_nonzero(kernel(driven).memory.marks) > seen
    view = driven.costmap(0)
    assert view.costs.max() == 254.0
    assert view.origin == (-0.5, -0.5)
