"""A night's scorecard: made once, and anew where what it is about has changed."""

from pathlib import Path

import pytest
from prefect.client.schemas.objects import State

from ses_core.recipes import ArtifactRef
from ses_core.robot_profile import JACKAL
from ses_core.scorecard_settings import ScorecardSettings
from ses_core.settings import Settings, SimulationSettings
from storage.artifact_store import LocalArtifactStore
from storage.materialize import Materialized
from storage.scorecard_files import read_scored
from tasks.scorecard import score_artifacts
from tests.ses_core.scorecard.samples import pillars
from tests.ses_core.synthesis.places import domain_of
from tests.tasks.stored_places import select, synthesize

SETTINGS = Settings(
    scorecard=ScorecardSettings(halvings=2, permutations=19, driven=2),
    simulation=SimulationSettings(time_limit_s=4.0),
)


@pytest.fixture
def store(tmp_path: Path) -> LocalArtifactStore:
    return LocalArtifactStore(tmp_path / "store")


def score(
    store: LocalArtifactStore,
    selection: ArtifactRef,
    environments: ArtifactRef,
    settings: Settings = SETTINGS,
    *,
    policy: str = "dwa-slow",
) -> Materialized:
    """Score; a scorecard that was found comes as the data of a state."""
    made = score_artifacts.fn(
        selection, environments, policy=policy, store=store, settings=settings
    )
    data = made.data if isinstance(made, State) else made
    assert isinstance(data, Materialized)
    return data


def test_the_pool_is_halved_by_site_and_the_draws_are_known(store: LocalArtifactStore) -> None:
    pool = select(store, pillars(12, seed=0), ["a", "b", "c"] * 4)
    made = synthesize(store, domain_of(pillars(6, seed=1)))
    found = read_scored(store.path(score(store, pool, made).ref))
    rows = {row.metric: row for row in found.rows}
    assert rows["coverage"].halves == "by site (3)"
    assert rows["traversable, raw"].value == 0.75
    assert (rows["mean time"].n_synthesized, rows["mean time"].n_real) == (2, 4)
    assert rows["mean time"].feature == "drives of dwa-slow"


def test_asked_again_nothing_is_computed(store: LocalArtifactStore) -> None:
    pool = select(store, pillars(12, seed=0), ["a", "b", "c"] * 4)
    made = synthesize(store, domain_of(pillars(6, seed=1)))
    first = score(store, pool, made)
    folder = store.path(first.ref)
    before = {path: path.stat().st_mtime_ns for path in folder.iterdir()}
    second = score(store, pool, made)
    assert (first.found, second.found) == (False, True)
    assert second.ref == first.ref
    assert {path: path.stat().st_mtime_ns for path in folder.iterdir()} == before


def test_whatever_it_is_about_makes_it_another(store: LocalArtifactStore) -> None:
    cells, sites = pillars(12, seed=0), ["a", "b", "c"] * 4
    pool = select(store, cells, sites)
    made = synthesize(store, domain_of(pillars(6, seed=1)))
    assert not score(store, pool, made).found
    regrouped = select(store, cells, ["a"] * 6 + ["b"] * 6)
    assert not score(store, regrouped, made).found
    assert not score(store, pool, synthesize(store, domain_of(pillars(7, seed=1)))).found
    assert not score(store, pool, made, policy="dwa-fast").found
    for changed in (
        {"scorecard": SETTINGS.scorecard.model_copy(update={"driven": 1})},
        {"simulation": SETTINGS.simulation.model_copy(update={"time_limit_s": 3.0})},
        {"target_robot": JACKAL.model_copy(update={"max_speed_mps": 1.5})},
    ):
        assert not score(store, pool, made, SETTINGS.model_copy(update=changed)).found
    trained_longer = SETTINGS.training.model_copy(update={"steps": 7})
    assert score(store, pool, made, SETTINGS.model_copy(update={"training": trained_longer})).found
