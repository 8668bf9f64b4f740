"""Tests of training stages: the bundle is what the settings asked for."""

from pathlib import Path

import pytest

from ses_core.learning import pretraining
from ses_core.robot_profile import TURTLEBOT4
from ses_core.settings import Settings, TrainingSettings
from ses_core.worlds.cellular_automata import generate_barn_world
from storage.policy_files import read_policy
from tasks.train import pretrain_policy


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
