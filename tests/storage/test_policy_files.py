"""Tests of policies on disk and of the names they are found by."""

from pathlib import Path

import numpy as np
import pytest

from ses_core.errors import ArtifactError
from ses_core.learning.action import SEVEN
from ses_core.learning.observation import DEFAULT_OBSERVATION
from ses_core.learning.policies import FIXED_POLICIES, ParameterPolicy, random_policy
from ses_core.learning.policy_bundle import BUNDLE_FILES, Lineage, policy_id
from ses_core.learning.reward import DEFAULT_REWARD
from ses_core.learning.training_curve import CurvePoint
from ses_core.recipes import ArtifactRef, Recipe
from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings
from storage.artifact_store import LocalArtifactStore
from storage.layout import open_layout
from storage.policy_files import (
    ORIGINAL_FOLDER,
    find_policy,
    read_curve,
    read_policy,
    write_curve,
    write_policy,
)
from storage.policy_registry import PolicyRegistry
from storage.stages import TRAIN


def some_policy(seed: int) -> ParameterPolicy:
    return random_policy(DEFAULT_OBSERVATION, (8,), rng=np.random.default_rng(seed))


def write_some(directory: Path, seed: int, *, run: str = "") -> None:
    lineage = Lineage(
        parent_id="",
        run_id=run,
        algorithm="ppo",
        steps=5,
        seed=seed,
        environments=2,
        trained_in="drawn places",
    )
    write_policy(
        directory,
        some_policy(seed),
        lineage=lineage,
        profile=JACKAL,
        simulation=SimulationSettings(),
        reward=DEFAULT_REWARD,
    )


def train_into(store: LocalArtifactStore, seed: int, *, run: str) -> ArtifactRef:
    return store.put(
        Recipe(TRAIN, {"seed": seed}), lambda folder: write_some(folder, seed, run=run)
    )


def test_a_bundle_is_found_by_its_folder(tmp_path: Path) -> None:
    write_some(tmp_path / "mine", 1)
    found = find_policy(str(tmp_path / "mine"), None)
    assert found.policy_id == policy_id(some_policy(1))
    assert {file.name for file in (tmp_path / "mine").iterdir()} == set(BUNDLE_FILES)


def test_fixed_policies_need_no_bundle() -> None:
    found = find_policy("dwa-fast", None)
    assert found.policy == FIXED_POLICIES["dwa-fast"]
    assert found.bundle is None


def test_the_champion_is_the_original_until_one_is_promoted(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    layout = open_layout(tmp_path)
    original = read_policy(ORIGINAL_FOLDER).policy_id
    assert find_policy("original", None).policy_id == original
    assert find_policy("champion", None).policy_id == original
    assert find_policy("champion", layout).policy_id == original
    PolicyRegistry(layout).promote(
        train_into(store, 1, run="night-1"), policy_id="p", run_id="night-1", reason="test"
    )
    assert find_policy("champion", layout).policy_id == policy_id(some_policy(1))


def test_a_trained_policy_is_found_by_its_run_and_by_its_id(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    layout = open_layout(tmp_path)
    train_into(store, 1, run="night-1")
    train_into(store, 2, run="night-2")
    second = policy_id(some_policy(2))
    assert find_policy("night-2", layout).policy_id == second
    assert find_policy(second, layout).policy_id == second


def test_an_unknown_name_lists_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match=r"no policy 'best'.*dwa-slow, dwa-fast"):
        find_policy("best", open_layout(tmp_path))


def test_a_damaged_bundle_names_its_folder(tmp_path: Path) -> None:
    write_some(tmp_path / "mine", 1)
    (tmp_path / "mine" / "policy.onnx").unlink()
    with pytest.raises(ArtifactError, match=r"mine lacks policy\.onnx"):
        find_policy(str(tmp_path / "mine"), None)


def test_a_learning_curve_reads_back_as_written(tmp_path: Path) -> None:
    curve = [
        CurvePoint(
            steps=10 * number,
            episodes=3,
            mean_return=1.5,
            success_rate=0.5,
            collision_rate=0.25,
            mean_time_s=None if number == 1 else 9.0,
        )
        for number in (1, 2)
    ]
    write_curve(tmp_path, curve)
    assert read_curve(tmp_path) == curve
    assert read_curve(tmp_path / "elsewhere") == []
    (tmp_path / "curve.json").write_text("[{}]")
    with pytest.raises(ArtifactError, match="cannot be read"):
        read_curve(tmp_path)


def test_the_shipped_original_is_small_and_for_the_jackal() -> None:
    files = [ORIGINAL_FOLDER / name for name in BUNDLE_FILES]
    assert sum(file.stat().st_size for file in files) < 2_000_000
    bundle = read_policy(ORIGINAL_FOLDER)
    assert bundle.robot == JACKAL.name
    assert bundle.lineage.parent_id == ""
    # What it sets depends on what it sees: it is no constant in disguise.
    seen = np.random.default_rng(0).uniform(-0.5, 0.5, (100, DEFAULT_OBSERVATION.length(SEVEN)))
    assert np.ptp(bundle.policy.actions(seen), axis=0).max() > 0.2
