"""Critics taken out of a learner and put into another (leaf: stable-baselines3, torch)."""

from collections.abc import Mapping

import torch
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from torch import nn

from ses_core.arrays import Float32Array


def extract_critic(learner: BaseAlgorithm) -> dict[str, Float32Array]:
    """Copy the tensors of a learner's critic, by name."""
    return {
        f"{part}.{name}": value.detach().cpu().numpy().copy()
        for part, module in _critics(learner).items()
        for name, value in module.state_dict().items()
    }


def set_critic(learner: BaseAlgorithm, tensors: Mapping[str, Float32Array]) -> None:
    """Put a critic's tensors into a learner; target critics become its equals.

    Raises:
        ValueError: They are another algorithm's, or of other sizes.
    """
    parts = _critics(learner)
    expected = {f"{part}.{name}" for part in parts for name in parts[part].state_dict()}
    if expected != set(tensors):
        raise ValueError(
            "the critic to go on from is another algorithm's; without training.keep_critic a new "
            "one is trained"
        )
    for part, module in parts.items():
        own = {
            name: torch.from_numpy(tensors[f"{part}.{name}"].copy()) for name in module.state_dict()
        }
        try:
            module.load_state_dict(own)
        except RuntimeError as error:
            raise ValueError(f"the critic to go on from has other sizes: {error}") from error
    if isinstance(learner, TD3 | SAC):
        learner.critic_target.load_state_dict(learner.critic.state_dict())


def _critics(learner: BaseAlgorithm) -> dict[str, nn.Module]:
    if isinstance(learner, PPO):
        return {
            "hidden": learner.policy.mlp_extractor.value_net,
            "value": learner.policy.value_net,
        }
    if isinstance(learner, TD3 | SAC):
        return {"values": learner.critic}
    raise ValueError(f"found a learner of type {type(learner).__name__}, expected PPO, TD3, SAC")
