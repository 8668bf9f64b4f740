"""What a policy bundle says in words: what is seen, set and rewarded, with units, and the card."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ses_core.learning.action import ACTIONS, ActionParameter, ActionSpec
from ses_core.learning.observation import ObservationSpec
from ses_core.learning.reward import RewardSpec
from ses_core.planning.parameters import PARAMETER_UNITS
from ses_core.recipes import settings_json


def observation_record(spec: ObservationSpec, action: ActionSpec) -> dict[str, Any]:
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
                "length": action.length,
                "unit": "own",
                "range": "those of the action",
                "normalisation": "2 (parameter - low) / (high - low) - 1",
            }
        )
    return {**settings_json(spec), "length": spec.length(action), "parts": parts}


def action_record(action: ActionSpec) -> dict[str, Any]:
    """Give the parameters with units, bounds and the formula from an action."""
    formula = "parameter = low + (action + 1) / 2 (high - low), action in [-1, 1]"
    if action.is_log.any():
        formula += "; on a log scale for the logarithms of parameter, low and high"
    return {
        "normalisation": formula,
        "parameters": [_parameter_record(parameter) for parameter in action.parameters],
    }


def read_action(record: Mapping[str, Any]) -> ActionSpec:
    """Read back what `action_record` gave, under the name that the set has here, if any.

    Raises:
        ValueError: The planner has no such parameter, or its bounds are no bounds.
    """
    parameters = tuple(
        ActionParameter(
            name=row["name"], low=row["low"], high=row["high"], scale=row.get("scale", "linear")
        )
        for row in record["parameters"]
    )
    known = {spec.parameters: spec for spec in ACTIONS.values()}
    return known.get(parameters) or ActionSpec(name="own", parameters=parameters)


def _parameter_record(parameter: ActionParameter) -> dict[str, Any]:
    # Linear scales are not named, so that policies from before there were others keep their ids.
    scale = {} if parameter.scale == "linear" else {"scale": parameter.scale}
    return {
        "name": parameter.name,
        "unit": PARAMETER_UNITS[parameter.name],
        "low": parameter.low,
        "high": parameter.high,
        **scale,
    }


def reward_record(spec: RewardSpec) -> dict[str, Any]:
    """Give the weights of a reward with their formula; ways are in metres."""
    return {
        **settings_json(spec),
        "formula": "progress_weight (progress_discount way_after - way_before) + success at the "
        "goal - failure_penalty on a failure - collision_weight / (d + 0.05 m) where the 10 "
        "nearest readings are d < 0.3 m away on average",
    }


def policy_card(record: Mapping[str, Any]) -> str:
    """Write `policy.json` out for people."""
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
- Rewarded by: the preset `{record["reward"]["name"]}`, in full in `policy.json`
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
