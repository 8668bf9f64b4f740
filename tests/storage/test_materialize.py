from pathlib import Path

from ses_core.recipes import Recipe
from storage.artifact_store import LocalArtifactStore
from storage.materialize import materialize
from storage.stages import EXTRACT, STAGES


def test_the_second_time_is_found_and_not_built(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    built = 0

    def build(folder: Path) -> None:
        nonlocal built
        built += 1
        (folder / "rows").write_text("rows")

    first = materialize(store, Recipe(EXTRACT), build)
    second = materialize(store, Recipe(EXTRACT), build)
    assert (first.found, second.found, built) == (False, True, 1)
    assert first.ref == second.ref
    assert first.seconds >= 0.0


def test_every_stage_has_a_name_of_its_own() -> None:
    assert len({stage.name for stage in STAGES}) == len(STAGES)
