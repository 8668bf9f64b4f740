"""A policy bundle as bytes: what a robot loads, and everything needed to check and place it.

| file | content |
| --- | --- |
| `policy.safetensors` | `weight.0`, `bias.0`, ... float32, layer by layer |
| `policy.onnx` | the same policy for the target robot's laser, readings in, parameters out |
| `policy.json` | observation, action, network, lineage, digests |
| `card.md` | the same for people |

No part of it is pickled, and no part has a date in it: equal policies are equal bundles.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError
from safetensors import SafetensorError
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from ses_core.arrays import Float32Array
from ses_core.errors import ArtifactError
from ses_core.learning.observation import ObservationSpec, make_observer
from ses_core.learning.policies import DECISION_PERIOD_S, ParameterPolicy
from ses_core.planning.parameters import (
    PARAMETER_HIGH,
    PARAMETER_LOW,
    PARAMETER_NAMES,
    PARAMETER_UNITS,
)
from ses_core.recipes import canonical_json, digest_bytes, digest_json, settings_json
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings

SCHEMA_VERSION = 1
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
        digests: Of simulator, planner and robot at training, by name.
    """

    policy_id: str
    policy: ParameterPolicy
    lineage: Lineage
    robot: str
    digests: Mapping[str, str]


def policy_id(policy: ParameterPolicy) -> str:
    """Identify a policy by what it computes: 16 hexadecimal digits."""
    weights = digest_bytes(save_tensors(_tensors(policy)))
    return digest_json([weights, settings_json(policy.observation), _action_spec()])[:16]


def pack_bundle(
    policy: ParameterPolicy,
    *,
    lineage: Lineage,
    profile: RobotProfile,
    simulation: SimulationSettings,
) -> dict[str, bytes]:
    """Give the files of a bundle by name.

    Args:
        policy: What is packed.
        lineage: Where it comes from.
        profile: The robot it was trained for; its laser is the ONNX model's.
        simulation: The simulator it was trained in.
    """
    # onnx is needed where policies are packed, never where they are loaded.
    from ses_core.learning.onnx_export import export_onnx

    weights = save_tensors(_tensors(policy))
    model = export_onnx(policy, make_observer(policy.observation, profile), profile)
    record = {
        "schema_version": SCHEMA_VERSION,
        "policy_id": policy_id(policy),
        "robot": profile.name,
        "decision_period_s": DECISION_PERIOD_S,
        "observation": _observation_record(policy.observation),
        "action": _action_spec(),
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
            "action": digest_json(_action_spec()),
        },
    }
    return {
        WEIGHTS_FILE: weights,
        ONNX_FILE: model,
        JSON_FILE: (json.dumps(record, indent=2, sort_keys=True, allow_nan=False) + "\n").encode(),
        CARD_FILE: _card(record).encode(),
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
        if version != SCHEMA_VERSION:
            raise ArtifactError(
                f"policy {source} has schema version {version}, expected {SCHEMA_VERSION}"
            )
        _check_digests(files, record["digests"], source=source)
        if canonical_json(record["action"]) != canonical_json(_action_spec()):
            raise ArtifactError(
                f"policy {source} sets other parameters or bounds than this planner has"
            )
        layout = {name: record["observation"][name] for name in ObservationSpec.model_fields}
        policy = _policy(ObservationSpec(**layout), load_tensors(files[WEIGHTS_FILE]))
        bundle = PolicyBundle(
            policy_id=policy_id(policy),
            policy=policy,
            lineage=Lineage(**record["lineage"]),
            robot=record["robot"],
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


def _policy(spec: ObservationSpec, tensors: Mapping[str, Float32Array]) -> ParameterPolicy:
    layers = range(len(tensors) // 2)
    return ParameterPolicy(
        observation=spec,
        weights=tuple(tensors[f"weight.{number}"] for number in layers),
        biases=tuple(tensors[f"bias.{number}"] for number in layers),
    )


def _observation_record(spec: ObservationSpec) -> dict[str, Any]:
    """Give the layout with units, ranges and the formula of every part."""
    clip, goal = spec.laser_clip_m, spec.goal_clip_m
    parts: list[dict[str, Any]] = [
        {
            "name": "scan",
            "length": spec.sectors,
            "unit": "m",
            "range": [0.0, clip],
            "normalisation": f"(nearest reading of the sector - {clip / 2:g}) / {clip:g}",
        },
        {
            "name": "goal_angle",
            "length": 1,
            "unit": "rad",
            "range": [-float(np.pi), float(np.pi)],
            "normalisation": "angle / (2 pi)",
        },
    ]
    if goal is not None:
        parts.append(
            {
                "name": "goal_distance",
                "length": 1,
                "unit": "m",
                "range": [0.0, goal],
                "normalisation": f"min(distance, {goal:g}) / {goal:g} - 0.5",
            }
        )
    if spec.has_parameters:
        parts.append(
            {
                "name": "parameters",
                "length": len(PARAMETER_NAMES),
                "unit": "own",
                "range": "those of the action",
                "normalisation": "2 (parameter - low) / (high - low) - 1",
            }
        )
    return {**settings_json(spec), "length": spec.length, "parts": parts}


def _action_spec() -> dict[str, Any]:
    return {
        "normalisation": "parameter = low + (action + 1) / 2 (high - low), action in [-1, 1]",
        "parameters": [
            {"name": name, "unit": unit, "low": float(low), "high": float(high)}
            for name, unit, low, high in zip(
                PARAMETER_NAMES, PARAMETER_UNITS, PARAMETER_LOW, PARAMETER_HIGH, strict=True
            )
        ],
    }


def _card(record: Mapping[str, Any]) -> str:
    lineage, digests = record["lineage"], record["digests"]
    rows = "\n".join(
        f"| `{row['name']}` | {row['low']:g} | {row['high']:g} | {row['unit']} |"
        for row in record["action"]["parameters"]
    )
    parts = "\n".join(
        f"| {part['name']} | {part['length']} | {part['unit']} | `{part['normalisation']}` |"
        for part in record["observation"]["parts"]
    )
    return f"""# Policy {record["policy_id"]}

Sets the parameters of a dynamic-window planner once per {record["decision_period_s"]:g} s on a
{record["robot"]} (APPLR). It never commands a velocity itself.

- Trained in: {lineage["trained_in"]} ({lineage["environments"]} tasks)
- Algorithm: {lineage["algorithm"]}, {lineage["steps"]} decisions, seed {lineage["seed"]}
- Parent: {lineage["parent_id"] or "none, from random weights"}
- Run: {lineage["run_id"] or "none"}

## What it sees
| part | length | unit | normalisation |
| --- | --- | --- | --- |
{parts}

## What it sets
| parameter | least | most | unit |
| --- | --- | --- | --- |
{rows}

## Limits
Trained in simulation, among static obstacles, for one robot and its laser. It has been measured
only where an evaluation says so.

## Digests
{chr(10).join(f"- {name}: `{value}`" for name, value in sorted(digests.items()))}
"""
