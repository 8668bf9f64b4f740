"""A training under way as bytes, exact to the last random number (leaf: stable-baselines3, torch).

| file | content |
| --- | --- |
| `learner.safetensors` | networks, optimisers, entropy weight; TD3's and SAC's transitions |
| `state.json` | counters, learning curve, and every generator of random numbers |

When a checkpoint is made all robots start anew, in the training that goes on as in one that is
resumed, so that no simulator needs to be kept. No part is pickled.
"""

import json
from collections.abc import Mapping
from operator import attrgetter
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from ses_core.errors import ArtifactError
from ses_core.learning.vector_env import VectorNavigationEnv

TENSORS_FILE, STATE_FILE = "learner.safetensors", "state.json"

_TRANSITIONS = (
    "observations",
    "next_observations",
    "actions",
    "rewards",
    "dones",
    "timeouts",
)

_COUNTERS = ("num_timesteps", "_n_updates", "_episode_num")

Tensors = dict[str, NDArray[np.generic]]


def pack_checkpoint(
    learner: BaseAlgorithm,
    env: VectorNavigationEnv,
    watched: Mapping[str, Any],
    kept: Mapping[str, NDArray[np.generic]],
) -> dict[str, bytes]:
    """Give the files of a checkpoint by name.

    Args:
        learner: Between two rollouts.
        env: What it learns in.
        watched: What else must be known to go on, as JSON values.
        kept: The same, as arrays.
    """
    tensors = _learner_tensors(learner) | {f"kept/{name}": kept[name] for name in kept}
    if isinstance(learner, OffPolicyAlgorithm):
        tensors |= _transitions(cast("ReplayBuffer", learner.replay_buffer))
    _, keys, place, has_gauss, gauss = np.random.get_state(legacy=True)  # noqa: NPY002
    tensors["random.numpy"] = np.asarray(keys)
    tensors["random.torch"] = torch.get_rng_state().numpy()
    state = {
        "counters": {name: getattr(learner, name) for name in _COUNTERS},
        "groups": {
            name: _without_tensors(attrgetter(name)(learner).state_dict()["param_groups"])
            for name in _optimisers(learner)
        },
        "numpy": [int(place), int(has_gauss), float(gauss)],
        "env": env.random_state,
        "watched": dict(watched),
    }
    return {
        # A tensor is saved from its memory, which must be in the order of its rows.
        TENSORS_FILE: save_tensors(
            {name: np.ascontiguousarray(array) for name, array in tensors.items()}
        ),
        STATE_FILE: json.dumps(state, allow_nan=False).encode(),
    }


def restore_checkpoint(
    files: Mapping[str, bytes], learner: BaseAlgorithm, env: VectorNavigationEnv
) -> tuple[dict[str, Any], Tensors]:
    """Put a learner, made under the same settings, where a checkpoint was made.

    Returns:
        What was `watched`, and what was `kept`.

    Raises:
        ArtifactError: The files are damaged, or of another learner.
    """
    try:
        tensors, state = load_tensors(files[TENSORS_FILE]), json.loads(files[STATE_FILE])
        _set_learner(learner, tensors, state["groups"])
        if isinstance(learner, OffPolicyAlgorithm):
            _set_transitions(cast("ReplayBuffer", learner.replay_buffer), tensors)
        for name, value in state["counters"].items():
            setattr(learner, name, value)
        env.random_state = state["env"]
        place, has_gauss, gauss = state["numpy"]
        np.random.set_state(  # noqa: NPY002  (stable-baselines3 draws from the global generator)
            ("MT19937", tensors["random.numpy"], place, has_gauss, gauss)
        )
        torch.set_rng_state(torch.from_numpy(tensors["random.torch"].copy()))
        kept = {
            name.removeprefix("kept/"): array
            for name, array in tensors.items()
            if name.startswith("kept/")
        }
        return dict(state["watched"]), kept
    except Exception as error:
        raise ArtifactError(f"checkpoint cannot be read: {error}") from error


def _optimisers(learner: BaseAlgorithm) -> list[str]:
    names, _ = learner._get_torch_save_params()
    return [name for name in names if name.endswith("optimizer")]


def _learner_tensors(learner: BaseAlgorithm) -> Tensors:
    """Name every tensor of networks, optimisers and single variables."""
    names, variables = learner._get_torch_save_params()
    tensors: Tensors = {
        f"variable/{name}": attrgetter(name)(learner).detach().numpy() for name in variables
    }
    for name in names:
        state = attrgetter(name)(learner).state_dict()
        if not name.endswith("optimizer"):
            tensors |= {f"{name}/{key}": value.numpy() for key, value in state.items()}
            continue
        for number, moments in state["state"].items():
            tensors |= {f"{name}/{number}/{key}": value.numpy() for key, value in moments.items()}
    return tensors


def _set_learner(
    learner: BaseAlgorithm, tensors: Mapping[str, NDArray[Any]], groups: Mapping[str, Any]
) -> None:
    names, variables = learner._get_torch_save_params()
    for name in variables:
        with torch.no_grad():
            attrgetter(name)(learner).copy_(_tensor(tensors[f"variable/{name}"]))
    for name in names:
        inside = {
            key.removeprefix(f"{name}/"): _tensor(value)
            for key, value in tensors.items()
            if key.startswith(f"{name}/")
        }
        target = attrgetter(name)(learner)
        if name not in groups:
            target.load_state_dict(inside)
            continue
        moments: dict[int, dict[str, torch.Tensor]] = {}
        for key, value in inside.items():
            number, moment = key.split("/")
            moments.setdefault(int(number), {})[moment] = value
        target.load_state_dict({"state": moments, "param_groups": groups[name]})


def _without_tensors(groups: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Give an optimiser's groups as JSON values; fused ones keep their rate as a tensor."""
    return [
        {
            key: float(value) if isinstance(value, torch.Tensor) else value
            for key, value in group.items()
        }
        for group in groups
    ]


def _transitions(buffer: ReplayBuffer) -> Tensors:
    filled = buffer.buffer_size if buffer.full else buffer.pos
    tensors: Tensors = {
        f"buffer/{name}": getattr(buffer, name)[:filled]
        for name in _TRANSITIONS
        if getattr(buffer, name, None) is not None
    }
    return {**tensors, "buffer/place": np.array([buffer.pos, int(buffer.full)])}


def _set_transitions(buffer: ReplayBuffer, tensors: Mapping[str, NDArray[Any]]) -> None:
    for name in _TRANSITIONS:
        if f"buffer/{name}" in tensors:
            kept = tensors[f"buffer/{name}"]
            getattr(buffer, name)[: len(kept)] = kept
    place, is_full = tensors["buffer/place"].tolist()
    buffer.pos, buffer.full = int(place), bool(is_full)


def _tensor(array: NDArray[Any]) -> torch.Tensor:
    return torch.from_numpy(array.copy())
