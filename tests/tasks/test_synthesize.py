"""Fits: found again while their places are the same, begun from nothing or from an earlier one."""

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from ses_core.arrays import BoolArray
from ses_core.recipes import ArtifactRef
from ses_core.robot_profile import JACKAL
from ses_core.synthesis_settings import GanSettings, RandomSamplingSettings, SynthesisSettings
from storage.artifact_store import LocalArtifactStore
from storage.environment_files import write_environments
from storage.materialize import Materialized
from storage.stages import FIT
from storage.synthesizer_files import read_synthesizer
from tasks.synthesize import fit_synthesizer, import_environments, sample_environments
from tests.ses_core.synthesis.counted_fits import count_fits
from tests.ses_core.synthesis.places import domain_of, rooms

COLD = SynthesisSettings(synthesizer=GanSettings(least_environments=2), environments=5)
WARM = COLD.model_copy(update={"warm_start": True})


@pytest.fixture(autouse=True)
def _quick_fits_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two answers within the clock's resolution would have no order."""
    clock = iter(range(1, 10**6))
    monkeypatch.setattr("storage.artifact_store.time.time_ns", lambda: next(clock))
    monkeypatch.setattr("tasks.synthesize.report_progress", lambda _: lambda _: None)
    count_fits(monkeypatch)


@pytest.fixture
def store(tmp_path: Path) -> LocalArtifactStore:
    return LocalArtifactStore(tmp_path / "store")


def outcome(state: Any) -> Materialized:
    """Unwrap what a task returns: found ones come as a Prefect state."""
    return cast("Materialized", state if isinstance(state, Materialized) else state.data)


def places(store: LocalArtifactStore, cells: BoolArray) -> ArtifactRef:
    folder = store.layout.root.parent / "places"
    folder.mkdir(exist_ok=True)
    write_environments(folder, domain_of(cells), target=JACKAL)
    return outcome(import_environments.fn(folder, store=store)).ref


def fit(
    store: LocalArtifactStore,
    pool: ArtifactRef,
    settings: SynthesisSettings,
    *,
    anew: bool = False,
) -> Materialized:
    return outcome(fit_synthesizer.fn(pool, store=store, settings=settings, anew=anew))


def notes(store: LocalArtifactStore, made: Materialized) -> tuple[str, ...]:
    return read_synthesizer(store.path(made.ref)).plan.notes


def went_on_from(made: Materialized) -> tuple[str, ...]:
    return (f"went on from the earlier fit {made.ref.digest[:12]}",)


def test_an_unchanged_pool_is_never_fitted_again(store: LocalArtifactStore) -> None:
    pool, more = places(store, rooms(2)), places(store, rooms(3))
    first = fit(store, pool, COLD)
    assert not first.found
    for settings in (COLD, WARM):
        again = fit(store, pool, settings)
        assert (again.found, again.ref) == (True, first.ref)
    warm = fit(store, more, WARM)
    assert not warm.found
    again = fit(store, more, WARM)
    assert (again.found, again.ref) == (True, warm.ref)
    # The fit of the larger pool is newer now, and no reason to go on from it.
    again = fit(store, pool, WARM)
    assert (again.found, again.ref) == (True, first.ref)


def test_a_warm_start_goes_on_from_the_newest_earlier_fit(store: LocalArtifactStore) -> None:
    pools = [places(store, rooms(count)) for count in (2, 3, 4)]
    first = fit(store, pools[0], WARM)
    assert notes(store, first) == ()
    second = fit(store, pools[1], WARM)
    assert notes(store, second) == went_on_from(first)
    third = fit(store, pools[2], WARM)
    assert notes(store, third) == went_on_from(second)
    inputs = [answer.recipe["inputs"] for answer in store.answers(FIT)]
    assert inputs == [[str(second.ref)], [str(first.ref)], []]


def test_a_warm_fit_never_answers_for_one_from_nothing(store: LocalArtifactStore) -> None:
    fit(store, places(store, rooms(2)), COLD)
    pool = places(store, rooms(3))
    warm, cold = fit(store, pool, WARM), fit(store, pool, COLD)
    assert not cold.found
    assert cold.ref != warm.ref
    assert notes(store, cold) == ()


def test_a_fit_made_anew_does_not_go_on_from_itself(store: LocalArtifactStore) -> None:
    first = fit(store, places(store, rooms(2)), WARM)
    pool = places(store, rooms(3))
    second = fit(store, pool, WARM)
    again = fit(store, pool, WARM, anew=True)
    assert not again.found
    assert again.ref == second.ref
    assert notes(store, again) == went_on_from(first)


@pytest.mark.parametrize(
    "other",
    [
        COLD.model_copy(update={"synthesizer": GanSettings(epochs=7, least_environments=2)}),
        COLD.model_copy(update={"synthesizer": RandomSamplingSettings()}),
    ],
    ids=["other settings", "other method"],
)
def test_a_fit_of_another_synthesizer_is_not_gone_on_from(
    store: LocalArtifactStore, other: SynthesisSettings
) -> None:
    fit(store, places(store, rooms(2)), other)
    assert notes(store, fit(store, places(store, rooms(3)), WARM)) == ()


def test_what_stood_in_for_the_synthesizer_is_passed_over(store: LocalArtifactStore) -> None:
    first = fit(store, places(store, rooms(2)), WARM)
    few = fit(store, places(store, rooms(1)), WARM)
    assert "instead of gan: 1 environments to learn from, gan needs 2" in notes(store, few)[0]
    assert notes(store, fit(store, places(store, rooms(4)), WARM)) == went_on_from(first)


def test_a_damaged_earlier_fit_is_passed_over(store: LocalArtifactStore) -> None:
    first = fit(store, places(store, rooms(2)), WARM)
    second = fit(store, places(store, rooms(3)), WARM)
    for path in store.layout.object_folder(second.ref).glob("*.npz"):
        path.chmod(0o600)
        path.write_bytes(b"")
    assert notes(store, fit(store, places(store, rooms(4)), WARM)) == went_on_from(first)


@pytest.mark.parametrize("changed", [{"uncrossable": "reject"}, {"most_repaired_cells": 3}])
def test_how_the_uncrossable_are_treated_decides_what_is_found(
    store: LocalArtifactStore, changed: dict[str, str | int]
) -> None:
    settings = SynthesisSettings(synthesizer=RandomSamplingSettings(), environments=5)
    cells = np.concatenate((rooms(3), np.zeros((2, 30, 30), dtype=np.bool_)))
    cells[3:, 12] = True
    cells[4, 20, 3] = True
    pool = places(store, cells)
    made = fit(store, pool, settings)

    def sample(asked: SynthesisSettings) -> Materialized:
        return outcome(
            sample_environments.fn(made.ref, pool, store=store, settings=asked, target=JACKAL)
        )

    first, again = sample(settings), sample(settings)
    other = sample(settings.model_copy(update=changed))
    assert (first.found, again.found, other.found) == (False, True, False)
    assert other.ref != first.ref


def test_other_cells_under_the_same_ids_are_another_pool(store: LocalArtifactStore) -> None:
    first, second = places(store, rooms(40)), places(store, rooms(40, seed=1))
    assert first != second
    settings = SynthesisSettings(synthesizer=GanSettings(), environments=5)
    assert not fit(store, first, settings).found
    assert not fit(store, second, settings).found
    assert fit(store, second, settings).found


def test_another_number_of_environments_is_drawn_from_the_same_fit(
    store: LocalArtifactStore,
) -> None:
    pool = places(store, rooms(40))
    more = COLD.model_copy(update={"environments": 9})
    first, second = fit(store, pool, COLD), fit(store, pool, more)
    assert second.found
    assert second.ref == first.ref
