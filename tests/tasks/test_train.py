"""Tests of training stages: the bundle is what the settings asked for."""

import itertools
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from ses_core.learning import pretraining
from ses_core.robot_profile import TURTLEBOT4
from ses_core.settings import Settings, TrainingSettings
from ses_core.worlds.cellular_automata import generate_barn_world
from storage.checkpoint_files import CheckpointFile
from storage.policy_files import find_policy, read_critic, read_policy
from tasks.train import pretrain_policy, save_training
from tests.ses_core.learning.places import corridor


def test_a_policy_from_nothing_is_the_one_that_the_settings_ask_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    worlds = [generate_barn_world(number, seed=0).world for number in (1, 2)]
    monkeypatch.setattr(pretraining, "generated_worlds", lambda _: worlds)
    training = TrainingSettings(preset="paper", decision_period_s=0.5)
    pretrain_policy.fn(
        (),
        part=None,
        resolution=None,
        steps=64,
        seed=None,
        out=tmp_path,
        settings=Settings(training=training, target_robot=TURTLEBOT4),
    )
    bundle = read_policy(tmp_path)
    assert bundle.robot == "turtlebot4"
    assert bundle.policy.observation.name == "paper"
    assert bundle.policy.decision_period == 0.5
    assert bundle.reward is not None
    assert bundle.reward.name == "paper"


def test_a_killed_training_goes_on_and_ends_with_the_same_policy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = Settings(
        training=TrainingSettings(steps=2048, parallel_envs=16, checkpoint_steps=1000)
    )
    tasks = [corridor()]
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    save = partial(
        save_training,
        tasks=tasks,
        parent=None,
        run_id="",
        trained_in="a corridor",
        settings=settings,
    )
    save(whole)
    assert not (whole / "training.checkpoint").exists()

    def die() -> bool:
        if (killed / "training.checkpoint").is_file():
            raise KeyboardInterrupt
        return False

    with pytest.raises(KeyboardInterrupt):
        save(killed, deadline=die)
    decisions = itertools.count(1)
    save(killed, deadline=lambda: next(decisions) < 0)
    assert next(decisions) == 65  # of each of 16 robots: the second rollout alone
    assert read_policy(killed).policy_id == read_policy(whole).policy_id
    assert not (killed / "training.checkpoint").exists()


@pytest.mark.parametrize("content", [None, b"", b"PK no archive"])
def test_what_is_no_checkpoint_of_this_training_is_not_gone_on_from(
    tmp_path: Path, content: bytes | None
) -> None:
    path = tmp_path / "training.checkpoint"
    if content is None:
        CheckpointFile(path, asked="another").keep({"state.json": b"{}"})
        assert CheckpointFile(path, asked="another").found() == {"state.json": b"{}"}
    else:
        path.write_bytes(content)
    assert CheckpointFile(path, asked="this").found() is None


def test_a_parents_critic_is_kept_beside_it_and_gone_on_with_where_asked(tmp_path: Path) -> None:
    training = TrainingSettings(steps=64, parallel_envs=4)
    first, second = tmp_path / "first", tmp_path / "second"
    save = partial(save_training, tasks=[corridor()], run_id="", trained_in="a corridor")
    save(first, parent=None, settings=Settings(training=training))
    parent = find_policy(str(first), None)
    keeping = training.model_copy(update={"keep_critic": True, "learning_rate": 1e-9})
    save(second, parent=parent, settings=Settings(training=keeping))
    before, after = read_critic(first), read_critic(second)
    assert before is not None
    assert after is not None
    for name, tensor in before.items():
        np.testing.assert_allclose(after[name], tensor, atol=1e-6)
