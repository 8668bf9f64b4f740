"""Tests of policy bundles as bytes."""

import json
from dataclasses import replace

import numpy as np
import pytest

from ses_core.errors import ArtifactError
from ses_core.learning.action import EIGHT, SEVEN, ActionSpec
from ses_core.learning.observation import DEFAULT_OBSERVATION
from ses_core.learning.policies import ParameterPolicy, random_policy
from ses_core.learning.policy_bundle import (
    BUNDLE_FILES,
    JSON_FILE,
    WEIGHTS_FILE,
    Lineage,
    pack_bundle,
    policy_id,
    unpack_bundle,
)
from ses_core.learning.reward import AUTHORS_REWARD
from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings

LINEAGE = Lineage(
    parent_id="abc",
    run_id="night",
    algorithm="ppo",
    steps=1000,
    seed=3,
    environments=12,
    trained_in="drawn places",
)
REWARD = AUTHORS_REWARD.model_copy(update={"failure_penalty": 3.0})


def some_policy(seed: int = 0) -> ParameterPolicy:
    return random_policy(DEFAULT_OBSERVATION, (16, 8), rng=np.random.default_rng(seed))


def packed(seed: int = 0, policy: ParameterPolicy | None = None) -> dict[str, bytes]:
    return pack_bundle(
        policy or some_policy(seed),
        lineage=LINEAGE,
        profile=JACKAL,
        simulation=SimulationSettings(),
        reward=REWARD,
    )


def test_a_bundle_read_back_is_the_policy_that_was_packed() -> None:
    bundle = unpack_bundle(packed(), source="test")
    seen = np.random.default_rng(1).uniform(-0.5, 0.5, (5, DEFAULT_OBSERVATION.length(SEVEN)))
    np.testing.assert_array_equal(bundle.policy.act(seen), some_policy().act(seen))
    assert bundle.lineage == LINEAGE
    assert bundle.policy_id == policy_id(some_policy())
    assert bundle.robot == "jackal"
    assert bundle.reward == REWARD


def test_the_decision_period_travels_with_the_policy_and_is_part_of_its_name() -> None:
    policy = replace(some_policy(), decision_period=0.5)
    bundle = unpack_bundle(packed(policy=policy), source="test")
    assert bundle.policy.decision_period == 0.5
    assert bundle.policy_id == policy_id(policy) != policy_id(some_policy())
    assert "once per 0.5 s" in packed(policy=policy)["card.md"].decode()
    with pytest.raises(ArtifactError, match="is named"):
        unpack_bundle(changed_record(decision_period_s=0.5), source="test")
    with pytest.raises(ArtifactError, match="expected more than 0 s"):
        unpack_bundle(changed_record(decision_period_s=0.0), source="test")


def test_a_bundle_from_before_rewards_were_kept_is_read() -> None:
    files = changed_record(schema_version=1)
    record = json.loads(files[JSON_FILE])
    del record["reward"]
    bundle = unpack_bundle({**files, JSON_FILE: json.dumps(record).encode()}, source="test")
    assert bundle.reward is None
    assert bundle.policy_id == policy_id(some_policy())
    assert bundle.policy.decision_period == 1.0


def test_equal_policies_are_equal_bundles_and_others_are_not() -> None:
    assert packed() == packed()
    assert packed(1)[WEIGHTS_FILE] != packed()[WEIGHTS_FILE]
    assert policy_id(some_policy(1)) != policy_id(some_policy())


def test_the_record_says_units_and_ranges_of_all_that_is_seen_and_set() -> None:
    record = json.loads(packed()[JSON_FILE])
    assert [part["name"] for part in record["observation"]["parts"]] == [
        "scan",
        "goal_angle",
        "goal_distance",
        "parameters",
    ]
    assert sum(part["length"] for part in record["observation"]["parts"]) == 129
    assert record["action"]["parameters"][0] == {
        "name": "max_vel_x",
        "unit": "m/s",
        "low": 0.2,
        "high": 2.0,
    }
    assert set(record["digests"]) == {"weights", "onnx", "simulation", "robot_profile", "action"}


@pytest.mark.parametrize("file", ["policy.safetensors", "policy.onnx"])
def test_one_flipped_bit_is_found(file: str) -> None:
    files = packed()
    damaged = bytearray(files[file])
    damaged[len(damaged) // 2] ^= 1
    with pytest.raises(ArtifactError, match=f"damaged: {file}"):
        unpack_bundle({**files, file: bytes(damaged)}, source="test")


@pytest.mark.parametrize("file", BUNDLE_FILES)
def test_a_missing_file_is_named(file: str) -> None:
    files = packed()
    del files[file]
    with pytest.raises(ArtifactError, match=f"policy here lacks {file}"):
        unpack_bundle(files, source="here")


def changed_record(**changes: object) -> dict[str, bytes]:
    files = packed()
    return {**files, JSON_FILE: json.dumps({**json.loads(files[JSON_FILE]), **changes}).encode()}


def test_a_newer_bundle_is_refused() -> None:
    with pytest.raises(ArtifactError, match="schema version 3, expected at most 2"):
        unpack_bundle(changed_record(schema_version=3), source="test")


@pytest.mark.parametrize("action", [SEVEN, EIGHT])
def test_what_a_policy_sets_travels_with_it(action: ActionSpec) -> None:
    policy = random_policy(DEFAULT_OBSERVATION, (8,), rng=np.random.default_rng(0), action=action)
    bundle = unpack_bundle(packed(policy=policy), source="test")
    assert bundle.policy.action == action
    assert f"| `{action.names[-1]}` |" in packed(policy=policy)["card.md"].decode()


def test_a_bundle_for_other_bounds_or_parameters_is_refused() -> None:
    action = json.loads(packed()[JSON_FILE])["action"]
    action["parameters"][0]["high"] = 3.0
    with pytest.raises(ArtifactError, match="is named"):
        unpack_bundle(changed_record(action=action), source="test")
    action["parameters"][0]["name"] = "max_vel_y"
    with pytest.raises(ArtifactError, match="no parameter 'max_vel_y'"):
        unpack_bundle(changed_record(action=action), source="test")


def test_policies_from_before_actions_differed_keep_their_names() -> None:
    assert policy_id(some_policy()) == "89e6d159e84c1c9a"


def test_weights_under_another_observation_are_refused() -> None:
    observation = json.loads(packed()[JSON_FILE])["observation"]
    with pytest.raises(ArtifactError, match="is named"):
        unpack_bundle(
            changed_record(observation={**observation, "laser_clip_m": 2.0}), source="test"
        )
    with pytest.raises(ArtifactError, match="cannot be read"):
        unpack_bundle(changed_record(observation={**observation, "sectors": 60}), source="test")


@pytest.mark.parametrize("text", [b"", b"{", b"[]", b"{}", b"\xff"])
def test_a_record_that_is_none_is_refused(text: bytes) -> None:
    with pytest.raises(ArtifactError, match="cannot be read"):
        unpack_bundle({**packed(), JSON_FILE: text}, source="test")


def test_the_card_says_where_the_policy_comes_from() -> None:
    card = packed()["card.md"].decode()
    assert "drawn places (12 tasks)" in card
    assert "ppo, 1000 decisions, seed 3" in card
    assert "Rewarded by: the preset `authors`" in card
    assert "| `inflation_radius` | 0.1 | 0.6 | m |" in card
