"""Tests of training in the real simulator."""

import itertools
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
import torch

from ses_core.errors import ArtifactError
from ses_core.learning.action import SEVEN
from ses_core.learning.observation import (
    AUTHORS_OBSERVATION,
    DEFAULT_OBSERVATION,
    PAPER_OBSERVATION,
)
from ses_core.learning.policies import ParameterPolicy, random_policy
from ses_core.learning.training import TrainingResult, train
from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings, TrainingSettings
from tests.ses_core.learning.places import corridor

SHORT = TrainingSettings(steps=128, parallel_envs=4)
SEEN = np.random.default_rng(9).uniform(-0.5, 0.5, (40, DEFAULT_OBSERVATION.length(SEVEN)))


def parent() -> ParameterPolicy:
    return random_policy(DEFAULT_OBSERVATION, (32, 32), rng=np.random.default_rng(1))


def run(
    settings: TrainingSettings, start: ParameterPolicy | None, *, stop_after: int = 10_000
) -> TrainingResult:
    asked = itertools.count(1)
    return train(
        [corridor()],
        parent=start,
        settings=settings,
        simulation=SimulationSettings(sensing_rate_hz=2.0),
        profile=JACKAL,
        deadline=lambda: next(asked) > stop_after,
    )


@pytest.mark.parametrize("algorithm", ["ppo", "td3", "sac"])
def test_training_changes_weights_and_behaviour(algorithm: Literal["ppo", "td3", "sac"]) -> None:
    start = parent()
    result = run(SHORT.model_copy(update={"algorithm": algorithm}), start)
    assert result.reason == "finished"
    assert result.steps == 128
    assert result.policy.hidden_sizes == (32, 32)
    for before, after in zip(start.weights, result.policy.weights, strict=True):
        assert not np.array_equal(before, after)
    assert (np.abs(result.policy.actions(SEEN) - start.actions(SEEN)).max(axis=0) > 1e-4).all()
    assert result.curve
    assert result.curve[-1].steps <= result.steps


def test_equal_arguments_give_equal_weights_and_other_seeds_others() -> None:
    first, again = run(SHORT, None), run(SHORT, None)
    other = run(SHORT.model_copy(update={"seed": 1}), None)
    for one, two, three in zip(
        first.policy.weights, again.policy.weights, other.policy.weights, strict=True
    ):
        np.testing.assert_array_equal(one, two)
        assert not np.array_equal(one, three)
    assert first.curve == again.curve


def test_a_new_critic_learns_alone_first() -> None:
    start = parent()
    alone = SHORT.model_copy(update={"algorithm": "td3", "critic_share": 0.9})
    np.testing.assert_array_equal(
        run(alone, start, stop_after=24).policy.act(SEEN), start.act(SEEN)
    )
    together = alone.model_copy(update={"critic_share": 0.1})
    moved = run(together, start, stop_after=24).policy.act(SEEN) != start.act(SEEN)
    assert moved.any()


def test_a_passed_deadline_leaves_the_parent_as_it_is() -> None:
    start = parent()
    result = run(SHORT, start, stop_after=3)
    assert result.reason == "deadline"
    assert result.steps < 128
    np.testing.assert_array_equal(result.policy.act(SEEN), start.act(SEEN))


def test_presets_decide_what_a_policy_without_a_parent_is() -> None:
    ours = run(SHORT.model_copy(update={"steps": 16}), None).policy
    theirs = run(SHORT.model_copy(update={"steps": 16, "preset": "authors"}), None).policy
    papers = run(SHORT.model_copy(update={"steps": 16, "preset": "paper"}), None).policy
    assert (ours.observation, ours.hidden_sizes) == (DEFAULT_OBSERVATION, (256, 256))
    assert (theirs.observation, theirs.hidden_sizes) == (AUTHORS_OBSERVATION, (512, 512))
    assert (papers.observation, papers.hidden_sizes) == (PAPER_OBSERVATION, (512, 512))


def test_a_policy_decides_as_often_as_its_parent_unless_the_settings_say_otherwise() -> None:
    often = replace(parent(), decision_period=0.5)
    short = SHORT.model_copy(update={"steps": 16})
    asked = short.model_copy(update={"decision_period_s": 2.0})
    assert run(short, None).policy.decision_period == 1.0
    assert run(short, often).policy.decision_period == 0.5
    assert run(asked, often).policy.decision_period == 2.0
    assert run(asked, None).policy.decision_period == 2.0


def test_decisions_in_training_are_a_period_apart() -> None:
    episodes = {}
    for period in (0.5, 1.0):
        settings = SHORT.model_copy(update={"decision_period_s": period})
        curve = run(settings, None).curve
        episodes[period] = sum(point.episodes for point in curve)
    assert episodes[0.5] == pytest.approx(episodes[1.0] / 2, rel=0.3)


def test_no_task_is_refused() -> None:
    with pytest.raises(ValueError, match="found no task"):
        train(
            [],
            parent=None,
            settings=SHORT,
            simulation=SimulationSettings(),
            profile=JACKAL,
        )


@pytest.mark.parametrize(
    ("algorithm", "has_parent"), [("ppo", True), ("ppo", False), ("td3", True), ("sac", True)]
)
def test_a_training_that_goes_on_from_a_checkpoint_ends_as_if_never_stopped(
    algorithm: Literal["ppo", "td3", "sac"], has_parent: bool
) -> None:
    settings = TrainingSettings(
        # A rollout of PPO is 1,024 decisions, one of the others 32.
        steps=2048 if algorithm == "ppo" else 1024,
        parallel_envs=32,
        algorithm=algorithm,
        checkpoint_steps=350,
        critic_share=0.5,
    )

    def train_from(
        checkpoint: Mapping[str, bytes] | None, keep: Callable[[Mapping[str, bytes]], None]
    ) -> TrainingResult:
        return train(
            [corridor()],
            parent=parent() if has_parent else None,
            settings=settings,
            simulation=SimulationSettings(sensing_rate_hz=2.0),
            profile=JACKAL,
            checkpoint=checkpoint,
            keep=keep,
        )

    kept: list[Mapping[str, bytes]] = []
    whole = train_from(None, kept.append)
    assert len(kept) == (1 if algorithm == "ppo" else 2)
    np.random.seed(5)  # noqa: NPY002  (a new process would stand elsewhere)
    torch.manual_seed(5)
    resumed = train_from(kept[-1], lambda _: None)
    for a, b in zip(whole.policy.weights, resumed.policy.weights, strict=True):
        np.testing.assert_array_equal(a, b)
    assert resumed.curve == whole.curve
    assert resumed.steps == whole.steps


@pytest.mark.parametrize("damage", [b"", b"{}", b"x" * 40])
def test_a_damaged_checkpoint_is_refused(damage: bytes) -> None:
    with pytest.raises(ArtifactError, match="checkpoint cannot be read"):
        train(
            [corridor()],
            parent=None,
            settings=SHORT,
            simulation=SimulationSettings(),
            profile=JACKAL,
            checkpoint={"learner.safetensors": damage, "state.json": damage},
        )
