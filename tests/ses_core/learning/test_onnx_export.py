"""Tests of the ONNX model against the policy it was written from."""

import math
from dataclasses import replace

import numpy as np
import onnx
import pytest
from onnx.reference import ReferenceEvaluator

from ses_core.learning.action import EIGHT, SEVEN, ActionSpec
from ses_core.learning.observation import (
    AUTHORS_OBSERVATION,
    DEFAULT_OBSERVATION,
    ObservationSpec,
)
from ses_core.learning.onnx_export import export_onnx
from ses_core.learning.policies import ParameterPolicy, observer_for, random_policy
from ses_core.planning.parameters import DWA_SLOW
from ses_core.robot_profile import JACKAL, NEATO, RobotProfile
from tests.ses_core.learning.snapshots import Snapshot

COUNT = 20


def lively_policy(spec: ObservationSpec, action: ActionSpec) -> ParameterPolicy:
    policy = random_policy(spec, (64, 32), rng=np.random.default_rng(3), action=action)
    return replace(
        policy,
        weights=(*policy.weights[:-1], policy.weights[-1] * 30),
        biases=tuple(bias + np.float32(0.1) for bias in policy.biases),
    )


@pytest.mark.parametrize("spec", [AUTHORS_OBSERVATION, DEFAULT_OBSERVATION])
@pytest.mark.parametrize("action", [SEVEN, EIGHT])
@pytest.mark.parametrize("profile", [JACKAL, NEATO])
def test_the_model_sets_the_parameters_that_the_policy_sets(
    spec: ObservationSpec, action: ActionSpec, profile: RobotProfile
) -> None:
    policy = lively_policy(spec, action)
    rng = np.random.default_rng(4)
    scans = rng.uniform(-0.5, 9.0, (COUNT, profile.laser.beams)).astype(np.float32)
    scans[rng.random(scans.shape) < 0.1] = np.nan
    scans[rng.random(scans.shape) < 0.1] = np.inf
    angles = rng.uniform(-math.pi, math.pi, COUNT)
    distances = rng.uniform(0.0, 15.0, COUNT)
    in_force = action.decode(rng.uniform(-1.0, 1.0, (COUNT, action.length)))
    state = Snapshot(
        poses=np.zeros((COUNT, 3)),
        goals=np.stack([distances, np.zeros(COUNT)], axis=1),
        local_goals=np.stack([np.cos(angles), np.sin(angles)], axis=1),
    )
    inputs = {"scan": scans, "goal_angle": angles[:, None].astype(np.float32)}
    if spec.goal_clip_m is not None:
        inputs["goal_distance"] = distances[:, None].astype(np.float32)
    if spec.has_parameters:
        inputs["parameters"] = in_force[:, action.places].astype(np.float32)
    model = onnx.load_model_from_string(export_onnx(policy, profile))
    [exported] = ReferenceEvaluator(model).run(None, inputs)
    seen = observer_for(policy, profile).observe(scans, state, in_force)
    set_by_model = np.tile(DWA_SLOW.as_array(), (COUNT, 1))
    set_by_model[:, action.places] = exported
    expected = action.encode(policy.act(seen))
    np.testing.assert_allclose(action.encode(set_by_model), expected, atol=2e-5)
    assert (np.ptp(expected, axis=0) > 0.1).all()


def test_equal_policies_give_equal_models() -> None:
    first = export_onnx(lively_policy(DEFAULT_OBSERVATION, SEVEN), JACKAL)
    second = export_onnx(lively_policy(DEFAULT_OBSERVATION, SEVEN), JACKAL)
    assert first == second
