"""A policy bundle as bytes: what a robot loads, and everything needed to check and place it.

| file | content |
| --- | --- |
| `policy.safetensors` | `weight.0`, `bias.0`, ... float32, layer by layer |
| `policy.onnx` | the same policy for the target robot's laser, readings in, parameters out |
| `policy.json` | observation, action, reward, network, lineage, digests |
| `card.md` | the same for people |

No part of it is pickled, and no part has a date in it: equal policies are equal bundles.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, TypeVar

import numpy as np
from pydantic import ValidationError
from safetensors import SafetensorError
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from ses_core.arrays import Float32Array
from ses_core.errors import ArtifactError
from ses_core.learning.observation import ObservationSpec
from ses_core.learning.policies import DECISION_PERIOD_S, ParameterPolicy
from ses_core.learning.policy_record import (
    action_record,
    observation_record,
    policy_card,
    read_action,
    reward_record,
)
from ses_core.learning.reward import RewardSpec
from ses_core.recipes import JsonValue, digest_bytes, digest_json, settings_json
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings
from ses_core.settings_model import SettingsModel

_Spec = TypeVar("_Spec", bound=SettingsModel)

SCHEMA_VERSION = 2
"""Version 1 did not say what was rewarded."""

_READABLE_VERSIONS = (1, SCHEMA_VERSION)

WEIGHTS_FILE, ONNX_FILE, JSON_FILE, CARD_FILE = (
    "policy.safetensors",
    "policy.onnx",
    "policy.json",
    "card.md",
)
BUNDLE_FILES = (WEIGHTS_FILE, ONNX_FILE, JSON_FILE, CARD_FILE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lineage:
    """Where a policy comes from.

    Attributes:
        parent_id: The policy it was trained from; empty when trained from nothing.
        run_id: The run that trained it.
        steps: Decisions trained.
        environments: Number of navigation tasks it was trained in.
        trained_in: What those were, in words.
    """

    parent_id: str
    run_id: str
    algorithm: str
    steps: int
    seed: int
    environments: int
    trained_in: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicyBundle:
    """A policy with its identity and lineage, as read from a bundle.

    Attributes:
        policy_id: 16 hexadecimal digits of its weights and of what it sees and sets.
        robot: Name of the robot profile it was trained for.
        reward: What its training rewarded; None in bundles that do not say.
        digests: Of simulator, planner and robot at training, by name.
    """

    policy_id: str
    policy: ParameterPolicy
    lineage: Lineage
    robot: str
    reward: RewardSpec | None
    digests: Mapping[str, str]


def policy_id(policy: ParameterPolicy) -> str:
    """Identify a policy by what it computes: 16 hexadecimal digits.

    The usual decision period is left out, so that policies from before it was a setting keep
    their names.
    """
    weights = digest_bytes(save_tensors(_tensors(policy)))
    named: list[JsonValue] = [
        weights,
        settings_json(policy.observation),
        action_record(policy.action),
    ]
    if policy.decision_period != DECISION_PERIOD_S:
        named.append(policy.decision_period)
    return digest_json(named)[:16]


def pack_bundle(
    policy: ParameterPolicy,
    *,
    lineage: Lineage,
    profile: RobotProfile,
    simulation: SimulationSettings,
    reward: RewardSpec,
) -> dict[str, bytes]:
    """Give the files of a bundle by name.

    Args:
        policy: What is packed.
        lineage: Where it comes from.
        profile: The robot it was trained for; its laser is the ONNX model's.
        simulation: The simulator it was trained in.
        reward: What its training rewarded.
    """
    # onnx is needed where policies are packed, never where they are loaded.
    from ses_core.learning.onnx_export import export_onnx

    weights = save_tensors(_tensors(policy))
    model = export_onnx(policy, profile)
    record = {
        "schema_version": SCHEMA_VERSION,
        "policy_id": policy_id(policy),
        "robot": profile.name,
        "decision_period_s": policy.decision_period,
        "observation": observation_record(policy.observation, policy.action),
        "action": action_record(policy.action),
        "reward": reward_record(reward),
        "network": {
            "hidden_sizes": list(policy.hidden_sizes),
            "hidden_activation": "relu",
            "output_activation": "tanh",
        },
        "lineage": asdict(lineage),
        "digests": {
            "weights": digest_bytes(weights),
            "onnx": digest_bytes(model),
            "simulation": digest_json(settings_json(simulation)),
            "robot_profile": digest_json(settings_json(profile)),
            "action": digest_json(action_record(policy.action)),
        },
    }
    return {
        WEIGHTS_FILE: weights,
        ONNX_FILE: model,
        JSON_FILE: (json.dumps(record, indent=2, sort_keys=True, allow_nan=False) + "\n").encode(),
        CARD_FILE: policy_card(record).encode(),
    }


def unpack_bundle(files: Mapping[str, bytes], *, source: str) -> PolicyBundle:
    """Read a bundle's files back; weights and ONNX model are checked against their digests.

    Args:
        files: Content by file name.
        source: Where the files are from, for messages.

    Raises:
        ArtifactError: A file is missing or damaged, or the bundle is for other parameters.
    """
    missing = [name for name in BUNDLE_FILES if name not in files]
    if missing:
        raise ArtifactError(f"policy {source} lacks {', '.join(missing)}")
    try:
        record = json.loads(files[JSON_FILE])
        version = record["schema_version"]
        if version not in _READABLE_VERSIONS:
            raise ArtifactError(
                f"policy {source} has schema version {version}, expected at most {SCHEMA_VERSION}"
            )
        _check_digests(files, record["digests"], source=source)
        policy = _policy(record, load_tensors(files[WEIGHTS_FILE]))
        bundle = PolicyBundle(
            policy_id=policy_id(policy),
            policy=policy,
            lineage=Lineage(**record["lineage"]),
            robot=record["robot"],
            reward=None if version == 1 else _part(RewardSpec, record["reward"]),
            digests=dict(record["digests"]),
        )
    except (KeyError, TypeError, ValueError, ValidationError, SafetensorError) as error:
        raise ArtifactError(f"policy {source} cannot be read: {error}") from error
    if bundle.policy_id != record["policy_id"]:
        raise ArtifactError(
            f"policy {source} is named {record['policy_id']}, its weights are {bundle.policy_id}"
        )
    return bundle


def _check_digests(files: Mapping[str, bytes], digests: Mapping[str, str], *, source: str) -> None:
    for name, file in (("weights", WEIGHTS_FILE), ("onnx", ONNX_FILE)):
        found = digest_bytes(files[file])
        if found != digests[name]:
            raise ArtifactError(
                f"policy {source} is damaged: {file} has digest {found[:12]}, "
                f"expected {digests[name][:12]}"
            )


def _tensors(policy: ParameterPolicy) -> dict[str, Float32Array]:
    tensors: dict[str, Float32Array] = {}
    for number, (matrix, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        tensors[f"weight.{number}"] = np.ascontiguousarray(matrix)
        tensors[f"bias.{number}"] = np.ascontiguousarray(bias)
    return tensors


def _policy(record: Mapping[str, Any], tensors: Mapping[str, Float32Array]) -> ParameterPolicy:
    layers = range(len(tensors) // 2)
    return ParameterPolicy(
        observation=_part(ObservationSpec, record["observation"]),
        weights=tuple(tensors[f"weight.{number}"] for number in layers),
        biases=tuple(tensors[f"bias.{number}"] for number in layers),
        action=read_action(record["action"]),
        decision_period=record["decision_period_s"],
    )


def _part(kind: type[_Spec], record: Mapping[str, Any]) -> _Spec:
    """Read a specification from its record, which explains it with keys of its own."""
    return kind(**{name: record[name] for name in kind.model_fields})
