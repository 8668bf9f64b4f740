"""Tests of the policies."""

import numpy as np
import pytest
import torch

from ses_core.learning.action import SEVEN
from ses_core.learning.observation import AUTHORS_OBSERVATION, DEFAULT_OBSERVATION
from ses_core.learning.policies import (
    FIXED_POLICIES,
    FixedParameters,
    ParameterPolicy,
    observer_for,
    random_policy,
)
from ses_core.planning.parameters import (
    PlannerParameters,
)
from ses_core.robot_profile import JACKAL


def some_policy(seed: int = 0) -> ParameterPolicy:
    policy = random_policy(DEFAULT_OBSERVATION, (32, 16), rng=np.random.default_rng(seed))
    # A drawn policy is nearly constant; with a large last layer it spans its bounds.
    return ParameterPolicy(
        observation=policy.observation,
        weights=(*policy.weights[:-1], policy.weights[-1] * 200),
        biases=policy.biases,
    )


def some_observations(count: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return np.random.default_rng(1).uniform(-0.5, 0.5, (count, DEFAULT_OBSERVATION.length(SEVEN)))


def test_fixed_parameters_never_change() -> None:
    policy = FixedParameters(PlannerParameters(max_vel_x=0.7))
    given = policy.act(np.zeros((3, 5)))
    assert given.shape == (3, 8)
    assert (given[:, 0] == 0.7).all()


def test_dwa_fast_is_twice_as_fast_as_dwa_slow() -> None:
    slow = FIXED_POLICIES["dwa-slow"].act(np.zeros((1, 1)))[0]
    fast = FIXED_POLICIES["dwa-fast"].act(np.zeros((1, 1)))[0]
    assert (fast / slow).tolist() == [2.0, 1.0, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0]


def test_the_perceptron_agrees_with_torch() -> None:
    policy = some_policy()
    signal = torch.from_numpy(some_observations(9))
    last = len(policy.weights) - 1
    for number, (matrix, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        signal = torch.nn.functional.linear(
            signal, torch.from_numpy(matrix).double(), torch.from_numpy(bias).double()
        )
        signal = torch.tanh(signal) if number == last else torch.relu(signal)
    np.testing.assert_allclose(policy.actions(some_observations(9)), signal.numpy(), atol=1e-7)


def test_parameters_span_their_bounds_and_never_leave_them() -> None:
    policy = some_policy()
    observations = some_observations(500)
    parameters = policy.act(observations)
    low, high = SEVEN.bounds()
    assert (parameters[:, :7] >= low).all()
    assert (parameters[:, :7] <= high).all()
    assert (np.ptp(parameters[:, :7], axis=0) > 0.3 * (high - low)).all()
    np.testing.assert_array_equal(parameters, SEVEN.decode(policy.actions(observations)))


def test_a_robot_decides_the_same_alone_and_in_a_crowd() -> None:
    policy = some_policy()
    observations = some_observations(64)
    alone = np.concatenate([policy.act(row[None]) for row in observations])
    np.testing.assert_array_equal(policy.act(observations), alone)


def test_an_untrained_policy_starts_near_the_middle_of_the_bounds() -> None:
    policy = random_policy(AUTHORS_OBSERVATION, (64,), rng=np.random.default_rng(0))
    seen = np.random.default_rng(1).uniform(-0.5, 0.5, (50, 721))
    assert np.abs(policy.actions(seen)).max() < 0.3


def test_layers_that_do_not_fit_are_refused() -> None:
    policy = some_policy()
    with pytest.raises(ValueError, match="layer 1 has shapes"):
        ParameterPolicy(
            observation=policy.observation,
            weights=(policy.weights[0], policy.weights[0], policy.weights[2]),
            biases=policy.biases,
        )
    with pytest.raises(ValueError, match="has 16 outputs, expected 7"):
        ParameterPolicy(
            observation=policy.observation, weights=policy.weights[:2], biases=policy.biases[:2]
        )


def test_every_policy_has_an_observer() -> None:
    assert observer_for(some_policy(), JACKAL).spec == DEFAULT_OBSERVATION
    assert observer_for(FIXED_POLICIES["dwa-slow"], JACKAL).spec == DEFAULT_OBSERVATION
