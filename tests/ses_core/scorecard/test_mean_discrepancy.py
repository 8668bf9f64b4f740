import numpy as np
from scipy.stats import kstest
from sklearn.metrics.pairwise import rbf_kernel

from ses_core.scorecard.distances import euclidean
from ses_core.scorecard.mean_discrepancy import (
    gaussian_kernel,
    median_bandwidth,
    mmd_squared,
    permutation_p_value,
)
from tests.ses_core.scorecard.samples import all_of


def test_the_estimate_is_the_sum_over_pairs_with_sklearns_kernel() -> None:
    points = np.random.default_rng(0).normal(size=(23, 3)).astype(np.float32)
    distances = euclidean(points)
    kernel = gaussian_kernel(distances, 1.7)
    expected_kernel = rbf_kernel(points.astype(np.float64), gamma=1 / (2 * 1.7**2))
    assert np.allclose(kernel, expected_kernel, atol=1e-6)
    within = sum(kernel[i, j] for i in range(10) for j in range(10) if i != j) / 90
    beyond = sum(kernel[i, j] for i in range(10, 23) for j in range(10, 23) if i != j) / (13 * 12)
    across = kernel[:10, 10:].mean()
    assert np.isclose(
        mmd_squared(kernel, all_of(10), all_of(13, 10)), within + beyond - 2 * across, atol=1e-12
    )


def test_equal_samples_have_a_large_p_and_shifted_ones_the_smallest() -> None:
    rng = np.random.default_rng(0)
    points = np.concatenate((rng.normal(size=(40, 2)), rng.normal(size=(40, 2)) + 3.0))
    distances = euclidean(points.astype(np.float32))
    kernel = gaussian_kernel(distances, median_bandwidth(distances, all_of(80)))
    chance = {"permutations": 99, "rng": rng}
    assert permutation_p_value(kernel, all_of(40), all_of(40), permutations=99, rng=rng) > 0.9
    assert permutation_p_value(kernel, all_of(40), all_of(40, 40), **chance) == 0.01  # type: ignore[arg-type]


def test_under_the_null_p_values_are_uniform() -> None:
    rng = np.random.default_rng(7)
    found = []
    for _ in range(200):
        distances = euclidean(rng.normal(size=(16, 2)).astype(np.float32))
        kernel = gaussian_kernel(distances, median_bandwidth(distances, all_of(16)))
        found.append(permutation_p_value(kernel, all_of(8), all_of(8, 8), permutations=99, rng=rng))
    assert kstest(found, "uniform").pvalue > 0.01
    assert np.mean(np.array(found) <= 0.05) < 0.1


def test_the_bandwidth_is_the_median_between_different_maps() -> None:
    line = np.array([0.0, 1.0, 3.0, 7.0], dtype=np.float32)
    distances = np.abs(line[:, None] - line[None, :])
    assert median_bandwidth(distances, np.array([0, 0, 0, 1, 2, 3])) == 3.5
    assert median_bandwidth(distances, np.array([2, 2])) == 1.0
