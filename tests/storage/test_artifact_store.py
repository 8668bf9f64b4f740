import errno
import multiprocessing
import os
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ses_core.errors import ArtifactError
from ses_core.recipes import ArtifactRef, Recipe, Stage
from storage.artifact_store import LocalArtifactStore
from storage.stages import EXTRACT, INGEST
from tests.contracts.artifact_store import check_artifact_store

RECIPE = Recipe(INGEST, {"log": "a"})


def write(content: bytes) -> Callable[[Path], None]:
    def build(folder: Path) -> None:
        (folder / "rows").write_bytes(content)
        (folder / "model").mkdir()
        (folder / "model" / "weights").write_bytes(content[::-1])

    return build


def never(folder: Path) -> None:
    raise AssertionError("built although it was there")


def test_local_store_keeps_the_contract(tmp_path: Path) -> None:
    check_artifact_store(LocalArtifactStore(tmp_path))


def test_another_process_finds_what_was_put(tmp_path: Path) -> None:
    ref = LocalArtifactStore(tmp_path).put(RECIPE, write(b"abc"))
    other = LocalArtifactStore(tmp_path)
    assert other.find(RECIPE) == ref
    assert other.put(RECIPE, never) == ref


def test_staging_is_empty_after_success_failure_and_a_lost_race(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    store.put(RECIPE, write(b"abc"))
    with pytest.raises(AssertionError):
        store.put(Recipe(INGEST, {"log": "b"}), never)

    def lose(folder: Path) -> None:
        LocalArtifactStore(tmp_path).put(Recipe(INGEST, {"log": "c"}), write(b"winner"))
        write(b"loser")(folder)

    ref = store.put(Recipe(INGEST, {"log": "c"}), lose)
    assert (store.path(ref) / "rows").read_bytes() == b"winner"
    assert list(store.layout.staging.iterdir()) == []


def _build_when_told(
    root: Path, barrier: "multiprocessing.synchronize.Barrier", refs: Path
) -> None:
    store = LocalArtifactStore(root)

    def build(folder: Path) -> None:
        barrier.wait(timeout=60)
        write(b"the same in every process")(folder)

    ref = store.put(RECIPE, build)
    (refs / str(os.getpid())).write_text(str(ref))


def test_four_racing_processes_reach_one_object(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    barrier = context.Barrier(4)
    refs = tmp_path / "refs"
    refs.mkdir()
    workers = [
        context.Process(target=_build_when_told, args=(tmp_path / "store", barrier, refs))
        for _ in range(4)
    ]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(timeout=120)
    assert [worker.exitcode for worker in workers] == [0] * 4
    said = [path.read_text() for path in refs.iterdir()]
    assert len(said) == 4
    assert len(set(said)) == 1
    store = LocalArtifactStore(tmp_path / "store")
    assert len(list(store.layout.objects.glob("*/*"))) == 1
    assert list(store.layout.staging.iterdir()) == []


def test_every_flipped_bit_is_found_and_the_artifact_built_again(tmp_path: Path) -> None:
    content = b"forty-one bytes of rows, every bit counts"
    ref = LocalArtifactStore(tmp_path).put(RECIPE, write(content))
    folder = LocalArtifactStore(tmp_path).layout.object_folder(ref)
    for name in ("rows", "model/weights", ".manifest.json"):
        for bit in range(0, 8 * (folder / name).stat().st_size, 29):
            _flip(folder / name, bit)
            store = LocalArtifactStore(tmp_path)
            with pytest.raises(ArtifactError, match="damaged"):
                store.path(ref)
            assert store.find(RECIPE) is None
            assert store.put(RECIPE, write(content)) == ref
            assert (store.path(ref) / "rows").read_bytes() == content


def test_a_bit_flipped_after_the_first_look_is_found_by_its_new_stamp(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    ref = store.put(RECIPE, write(b"abc"))
    store.path(ref)
    _flip(store.path(ref) / "rows", 3)
    with pytest.raises(ArtifactError, match="damaged"):
        store.path(ref)


@pytest.mark.parametrize("name", ["rows", "model/weights", ".manifest.json"])
def test_a_missing_or_shortened_file_makes_the_artifact_a_miss(tmp_path: Path, name: str) -> None:
    store = LocalArtifactStore(tmp_path)
    ref = store.put(RECIPE, write(b"abc"))
    (store.path(ref) / name).unlink()
    assert store.find(RECIPE) is None
    store.put(RECIPE, write(b"abc"))
    path = store.path(ref) / name
    path.chmod(0o644)
    os.truncate(path, path.stat().st_size - 1)
    assert store.find(RECIPE) is None
    assert len(list(store.layout.corrupt.iterdir())) == 2


def test_a_damaged_file_leaves_the_others_of_its_artifact_usable(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    ref = store.put(RECIPE, write(b"abc"))
    _flip(store.layout.object_folder(ref) / "rows", 0)
    assert store.file(ref, "model/weights").read_bytes() == b"cba"
    with pytest.raises(ArtifactError, match="damaged"):
        store.file(ref, "rows")


def test_a_damaged_recipe_is_a_miss_and_is_written_again(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    ref = store.put(RECIPE, write(b"abc"))
    path = store.layout.recipe_file(INGEST.name, RECIPE.key())
    _flip(path, 8 * path.read_bytes().index(b"ingest/") + 100)
    assert store.find(RECIPE) is None
    assert store.put(RECIPE, write(b"abc")) == ref
    assert store.find(RECIPE) == ref


def test_what_comes_out_differently_the_second_time_replaces_a_lost_artifact(
    tmp_path: Path,
) -> None:
    store = LocalArtifactStore(tmp_path)
    first = store.put(RECIPE, write(b"one"))
    (store.path(first) / "rows").unlink()
    second = store.put(RECIPE, write(b"two"))
    assert second != first
    assert store.find(RECIPE) == second


def test_a_forgotten_recipe_is_built_again(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    first = store.put(RECIPE, write(b"one"))
    store.forget(RECIPE)
    assert store.find(RECIPE) is None
    assert store.put(RECIPE, write(b"one")) == first


def test_an_artifact_keeps_how_it_was_made(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    parent = store.put(RECIPE, write(b"abc"))
    child = Recipe(EXTRACT, {"distance_m": 5.0}, inputs=(parent,))
    ref = store.put(child, write(b"xyz"))
    answer = store.answer(child)
    assert answer is not None
    assert answer.ref == ref
    assert answer.recipe["inputs"] == [str(parent)]
    assert answer.size == 6


def test_what_readers_link_to_cannot_be_written(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    ref = store.put(RECIPE, write(b"abc"))
    assert (store.path(ref) / "rows").stat().st_mode & 0o222 == 0


def test_a_link_in_an_artifact_is_refused(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    with pytest.raises(ArtifactError, match="neither a file nor a folder"):
        store.put(RECIPE, lambda folder: (folder / "link").symlink_to("/etc/passwd"))


def test_a_full_disk_during_a_build_names_path_and_free_bytes(tmp_path: Path) -> None:
    def fill(folder: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(folder / "big"))

    with pytest.raises(ArtifactError, match=r"big: no space left on device \(\d+ bytes free\)"):
        LocalArtifactStore(tmp_path).put(RECIPE, fill)


def test_a_missing_input_of_a_build_is_not_blamed_on_the_disk(tmp_path: Path) -> None:
    def build(folder: Path) -> None:
        (folder / "rows").write_text((tmp_path / "absent").read_text())

    with pytest.raises(FileNotFoundError):
        LocalArtifactStore(tmp_path).put(RECIPE, build)


refs = st.builds(ArtifactRef, st.just("log"), st.text("0123456789abcdef", min_size=4, max_size=4))


@given(st.lists(refs, min_size=2, max_size=6, unique=True), st.randoms())
def test_keys_ignore_the_order_of_a_set_and_respect_that_of_a_list(
    inputs: list[ArtifactRef], random: Random
) -> None:
    shuffled = list(inputs)
    random.shuffle(shuffled)
    as_set = {Recipe(EXTRACT, input_set=frozenset(order)).key() for order in (inputs, shuffled)}
    as_list = {Recipe(EXTRACT, inputs=tuple(order)).key() for order in (inputs, shuffled)}
    assert len(as_set) == 1
    assert len(as_list) == (1 if shuffled == inputs else 2)
    assert as_set.isdisjoint(as_list)


def _flip(path: Path, bit: int) -> None:
    path.chmod(0o644)
    content = bytearray(path.read_bytes())
    content[bit // 8] ^= 1 << bit % 8
    path.write_bytes(content)


def test_answers_of_a_stage_are_listed_newest_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter(range(1, 1000))
    monkeypatch.setattr("storage.artifact_store.time.time_ns", lambda: next(clock))
    store = LocalArtifactStore(tmp_path)
    assert store.answers(INGEST) == []
    recipes = [Recipe(INGEST, {"log": name}) for name in "cab"]
    refs = [store.put(recipe, write(recipe.key().encode())) for recipe in recipes]
    store.put(Recipe(EXTRACT, {"log": "a"}), write(b"other stage"))
    outdated = Recipe(Stage(INGEST.name, INGEST.version + 1), {"log": "a"})
    store.put(outdated, write(b"other version"))
    store.layout.recipe_file(INGEST.name, recipes[1].key()).write_bytes(b"damaged")
    listed = store.answers(INGEST)
    assert [answer.ref for answer in listed] == [refs[2], refs[0]]
    assert listed[0].recipe == recipes[2].as_json()
