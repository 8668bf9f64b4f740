"""Tests of what a page says of verified difficulty: which counts are set beside which."""

from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest

from ses_core.evaluation.difficulty import VerifiedDifficulty
from ses_core.navigation import NavigationDomain
from ses_core.recipes import ArtifactRef, Recipe
from ses_core.settings import FilterSettings, Settings
from storage.artifact_store import LocalArtifactStore
from storage.difficulty_contents import gather_difficulty
from storage.difficulty_files import write_difficulties
from storage.night_artifacts import NightArtifacts
from storage.selection_files import read_selection
from storage.stages import DIFFICULTY
from tests.ses_core.scorecard.samples import pillars
from tests.ses_core.synthesis.places import domain_of
from tests.tasks.stored_places import select

POOL = pillars(4, seed=0)


@pytest.fixture
def store(tmp_path: Path) -> LocalArtifactStore:
    return LocalArtifactStore(tmp_path / "store")


def row(name: str, negative: float) -> VerifiedDifficulty:
    return VerifiedDifficulty(
        environment_id=name,
        policy_id="p",
        trials=3,
        negative_velocity_count=negative,
        not_forward_count=2.0 * negative,
        success_rate=1.0,
        restricted_mean_time_s=20.0,
    )


def put(store: LocalArtifactStore, rows: list[VerifiedDifficulty]) -> ArtifactRef:
    return store.put(
        Recipe(DIFFICULTY, {"rows": len(rows)}),
        lambda folder: write_difficulties(folder, rows, conditions="c"),
    )


def night(
    selection: ArtifactRef, difficulty: ArtifactRef | None, settings: Settings
) -> NightArtifacts:
    return NightArtifacts(
        run_id="night",
        batch_date=date(2026, 11, 22),
        settings=settings,
        parent="original",
        decision="",
        reasons=(),
        log_ids=(),
        refused=(),
        known_logs=0,
        waiting_logs=0,
        selection=selection,
        environments=None,
        scorecard=None,
        difficulty=difficulty,
        worlds=None,
        policy=None,
        evaluation=None,
        spot_check=None,
        stages=(),
        is_demonstration=False,
    )


def test_places_of_the_pool_that_were_driven_stand_beside_their_logged_counts(
    store: LocalArtifactStore,
) -> None:
    ref = select(store, POOL, ["a", "b", "a", "b"])
    selection, settings = read_selection(store.path(ref)), Settings()
    synthesized = NavigationDomain(
        tuple(
            replace(one, environment_id=f"drawn-{one.environment_id}")
            for one in domain_of(POOL).environments
        )
    )
    rows = [row("e1", 60.0), row("e0", 50.0), row("drawn-e0", 0.0), row("drawn-e1", 51.0)]
    found = gather_difficulty(
        night(ref, put(store, rows), settings), selection, synthesized, store=store
    )
    assert found is not None
    assert found.logged.tolist() == [99.0, 99.0]
    assert found.simulated.tolist() == [50.0, 60.0]
    assert {site: one.places for site, one in found.sites.items()} == {"a": 1, "b": 1}
    assert (found.threshold, found.whole.hard_again) == (50.0, 0.5)
    assert (found.synthesized, found.synthesized_hard) == (2, 0.5)
    assert (found.driver, found.trials, found.count_name) == ("original", 3, "steps with v < 0")


def test_the_nights_own_count_and_threshold_are_taken(store: LocalArtifactStore) -> None:
    ref = select(store, POOL, ["a"] * 4)
    selection = read_selection(store.path(ref))
    made = put(store, [row("e0", 49.5), row("e1", 49.4)])
    chosen = FilterSettings(count_kind="not-forward", challenging_share=0.5)
    found = gather_difficulty(
        night(ref, made, Settings(filter=chosen)), selection, NavigationDomain(()), store=store
    )
    assert found is not None
    assert found.simulated.tolist() == [99.0, 98.8]
    # The easiest chosen place has a count of 99: as many are hard again, fewer are not.
    assert (found.whole.challenging, found.whole.hard_again) == (2, 0.5)
    assert (found.synthesized, found.synthesized_hard) == (0, None)


def test_a_night_that_verified_nothing_has_nothing_to_say(store: LocalArtifactStore) -> None:
    ref = select(store, POOL, ["a"] * 4)
    selection = read_selection(store.path(ref))
    for made in (None, put(store, [])):
        told = gather_difficulty(
            night(ref, made, Settings()), selection, NavigationDomain(()), store=store
        )
        assert told is None
