"""Random numbers of a slot."""

import numpy as np

from ses_core.simulation.noise import draw_bits, draw_normal, draw_uniform
from tests.simulated import CLEAN, course, hall, kernel, put, simulator


def test_bits_are_those_of_splitmix64() -> None:
    slot = kernel(simulator(course(hall()), settings=CLEAN)).slot
    put(slot, random_state=0)
    # The first outputs for seed 0 of Vigna's reference implementation.
    expected = [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F]
    assert [int(draw_bits(slot)) for _ in range(3)] == expected


def test_normal_draws_have_mean_0_and_deviation_1() -> None:
    slot = kernel(simulator(course(hall()))).slot
    draws = np.array([draw_normal(slot) for _ in range(20_000)])
    assert abs(draws.mean()) < 0.03
    assert abs(draws.std() - 1.0) < 0.02
    assert abs(np.mean(np.abs(draws) < 1.0) - 0.683) < 0.02
    assert np.abs(draws).max() < 3.47


def test_uniform_draws_fill_the_unit_interval() -> None:
    slot = kernel(simulator(course(hall()))).slot
    draws = np.array([draw_uniform(slot) for _ in range(10_000)])
    assert 0.0 <= draws.min() < 0.01
    assert 0.99 < draws.max() < 1.0
    assert abs(draws.mean() - 0.5) < 0.01
