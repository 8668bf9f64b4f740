"""A night's verified difficulties: driven once, and only what is new where something is."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from prefect.client.schemas.objects import State

from ses_core.arrays import FloatArray
from ses_core.difficulty_settings import DifficultySettings
from ses_core.evaluation.difficulty import VerifiedDifficulty
from ses_core.learning import training
from ses_core.navigation import NavigationDomain, NavigationEnvironment, NavigationTask
from ses_core.recipes import ArtifactRef
from ses_core.robot_profile import JACKAL
from ses_core.settings import Settings, SimulationSettings, TrainingSettings
from storage.artifact_store import LocalArtifactStore
from storage.difficulty_files import (
    DIFFICULTIES_FILE,
    read_conditions,
    read_difficulties,
)
from storage.environment_files import write_environments
from storage.materialize import Materialized
from storage.policy_files import read_curve
from storage.stage_records import read_record
from storage.training_record import TRAINING_FILE, TrainingRecord
from tasks import difficulty
from tasks.difficulty import drive_again, verify_difficulty
from tasks.train import train_in_folder, train_policy
from tests.ses_core.scorecard.samples import pillars
from tests.ses_core.synthesis.places import domain_of
from tests.tasks.stored_places import select, synthesize

SETTINGS = Settings(
    difficulty=DifficultySettings(trials=1, recorded=2),
    simulation=SimulationSettings(time_limit_s=20.0),
)


@pytest.fixture
def store(tmp_path: Path) -> LocalArtifactStore:
    return LocalArtifactStore(tmp_path / "store")


def drawn(count: int) -> NavigationDomain:
    """Give synthesized environments, whose ids are none of the pool's."""
    places = domain_of(pillars(count, seed=1)).environments
    return NavigationDomain(
        tuple(
            replace(one, environment_id=f"drawn-{one.environment_id}", scenario_id="")
            for one in places
        )
    )


def check(
    store: LocalArtifactStore,
    selection: ArtifactRef,
    environments: ArtifactRef,
    settings: Settings = SETTINGS,
    *,
    policy: str = "dwa-slow",
) -> Materialized:
    """Verify; what was found comes as the data of a state."""
    made = verify_difficulty.fn(
        selection, environments, policy=policy, store=store, settings=settings
    )
    data = made.data if isinstance(made, State) else made
    assert isinstance(data, Materialized)
    return data


def test_the_hardest_recorded_and_all_synthesized_are_driven(store: LocalArtifactStore) -> None:
    pool, made = pillars(4, seed=0), drawn(3)
    done = check(store, select(store, pool, ["a"] * 4), synthesize(store, made))
    rows = read_difficulties(store.path(done.ref))
    wanted = [*domain_of(pool).environments[:2], *made.environments]
    assert [row.environment_id for row in rows] == [one.environment_id for one in wanted]
    assert {(row.policy_id, row.trials) for row in rows} == {("dwa-slow", 1)}
    assert all(row.restricted_mean_time_s > 3.0 for row in rows)
    table = pd.read_parquet(store.path(done.ref) / DIFFICULTIES_FILE)
    assert table.run_id.isna().all()


def test_asked_again_nobody_drives_and_another_policy_does(store: LocalArtifactStore) -> None:
    pool = select(store, pillars(2, seed=0), ["a"] * 2)
    made = synthesize(store, drawn(2))
    first = check(store, pool, made)
    again = check(store, pool, made)
    assert (first.found, again.found, again.ref) == (False, True, first.ref)
    assert not check(store, pool, made, policy="dwa-fast").found
    more = SETTINGS.model_copy(update={"difficulty": DifficultySettings(trials=2, recorded=2)})
    assert not check(store, pool, made, more).found


def test_what_an_earlier_night_drove_is_not_driven_again(
    store: LocalArtifactStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    pool = select(store, pillars(2, seed=0), ["a"] * 2)
    made = synthesize(store, drawn(2))
    folder = store.path(check(store, pool, made).ref)
    rows = {row.environment_id: row for row in read_difficulties(folder)}
    asked: list[str] = []

    def known(root: Path, conditions: str) -> dict[str, VerifiedDifficulty]:
        asked.append(conditions)
        return dict(rows)

    monkeypatch.setattr(difficulty, "known_difficulties", known)
    larger = synthesize(store, drawn(3))
    driven: list[str] = []

    def drive(
        places: Sequence[NavigationEnvironment], *arguments: Any, **named: Any
    ) -> list[VerifiedDifficulty]:
        driven.extend(one.environment_id for one in places)
        return drive_again(places, *arguments, **named)

    monkeypatch.setattr(difficulty, "drive_again", drive)
    together = read_difficulties(store.path(check(store, pool, larger).ref))
    assert asked == [read_conditions(folder)]
    assert driven == [row.environment_id for row in together if row.environment_id not in rows]
    assert len(driven) == 1
    assert [row for row in together if row.environment_id in rows] == list(rows.values())


def test_recorded_places_are_entered_as_they_were_in_the_log(
    store: LocalArtifactStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    pool = select(store, np.zeros((1, 30, 30), dtype=np.bool_), ["a"])
    made = synthesize(store, drawn(1))
    ahead = read_difficulties(store.path(check(store, pool, made).ref))
    monkeypatch.setattr(difficulty, "logged_headings", lambda _, places: {"e0": math.pi})
    back = read_difficulties(store.path(check(store, pool, made).ref))
    assert back[0].environment_id == "e0"
    assert back[0].restricted_mean_time_s > ahead[0].restricted_mean_time_s + 1.0
    assert back[1] == ahead[1]


def test_what_is_hard_is_drawn_more_often(
    store: LocalArtifactStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn_by: list[FloatArray | None] = []
    train = training.train

    def spy(tasks: Sequence[NavigationTask], **named: Any) -> training.TrainingResult:
        drawn_by.append(named["weights"])
        return train(tasks, **named)

    monkeypatch.setattr(training, "train", spy)
    made = synthesize(store, drawn(3))
    short = TrainingSettings(steps=32, parallel_envs=2, difficulty="weigh")
    settings = SETTINGS.model_copy(update={"training": short})
    found = check(store, select(store, pillars(2, seed=0), ["a"] * 2), made, settings)
    train_policy.fn(
        made,
        difficulty=found.ref,
        parent="original",
        run_id="night",
        store=store,
        settings=settings,
    )
    times = [row.restricted_mean_time_s for row in read_difficulties(store.path(found.ref))]
    (weights,) = drawn_by
    assert weights is not None
    np.testing.assert_allclose(weights, 0.2 + np.array(times[2:]) / 100.0)


def test_training_by_difficulty_draws_only_what_is_left(
    store: LocalArtifactStore, tmp_path: Path
) -> None:
    """One empty place is crossed at once and filtered out; walls all across are not."""
    cells = np.zeros((3, 30, 30), dtype=np.bool_)
    cells[1:, 14:16, 1:29] = True
    cells[2, 20, 3] = True
    domain = domain_of(cells)
    short = TrainingSettings(steps=32, parallel_envs=2, difficulty="filter")
    settings = SETTINGS.model_copy(update={"training": short})
    made = synthesize(store, domain)
    found = check(store, select(store, pillars(2, seed=0), ["a"] * 2), made, settings)
    counts = {}
    for use in ("ignore", "weigh", "filter"):
        chosen = settings.model_copy(
            update={"training": short.model_copy(update={"difficulty": use})}
        )
        policy = train_policy.fn(
            made,
            difficulty=found.ref,
            parent="original",
            run_id="night",
            store=store,
            settings=chosen,
        )
        assert isinstance(policy, Materialized)
        folder = store.path(policy.ref)
        counts[use] = read_record(folder / TRAINING_FILE, TrainingRecord).environments
    assert counts == {"ignore": 3, "weigh": 3, "filter": 2}

    (tmp_path / "places").mkdir()
    write_environments(tmp_path / "places", domain, target=JACKAL)
    record = train_in_folder.fn(
        tmp_path / "places", parent="original", out=tmp_path / "out", store=store, settings=settings
    )
    assert record.environments == 2
    assert read_curve(tmp_path / "out") is not None


def test_difficulty_that_is_not_verified_cannot_be_trained_by() -> None:
    with pytest.raises(ValueError, match="expected at least 1 trial"):
        Settings(
            difficulty=DifficultySettings(trials=0), training=TrainingSettings(difficulty="weigh")
        )
