from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ses_core.errors import ArtifactError
from storage.artifact_store import LocalArtifactStore
from storage.policy_registry import PolicyRegistry
from storage.table_log import TableLog
from storage.table_reader import open_table
from storage.verification import Damage, verify
from tests.storage.sample_tables import commit_sample, recipe_of

TABLES = ("logs", "scans", "scenarios")


@pytest.fixture
def store(tmp_path: Path) -> LocalArtifactStore:
    store = LocalArtifactStore(tmp_path)
    log = TableLog(store.layout)
    for tag in ("a", "b"):
        ref = commit_sample(store, log, tag, tables=TABLES)
    PolicyRegistry(store.layout).promote(ref, policy_id="p", run_id="r", reason="better")
    return store


def flip(path: Path, bit: int) -> None:
    path.chmod(0o644)
    content = bytearray(path.read_bytes())
    content[bit // 8] ^= 1 << bit % 8
    path.write_bytes(content)


def take_in_again(store: LocalArtifactStore) -> None:
    log = TableLog(store.layout)
    for tag in ("a", "b"):
        commit_sample(store, log, tag, tables=TABLES)


def test_a_sound_store_has_no_findings(store: LocalArtifactStore) -> None:
    result = verify(store.layout)
    assert result.findings == ()
    assert (result.artifacts, result.recipes, result.entries, result.parts) == (2, 2, 3, 6)


def test_every_flipped_bit_of_a_part_is_found_on_reading(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path)
    log = TableLog(store.layout)
    commit_sample(store, log, "a", tables=("selections",))
    path = store.layout.table_folder("selections") / "a.parquet"
    whole = path.read_bytes()
    expected = open_table(tmp_path, "selections")
    rng = np.random.default_rng(11)
    for bit in rng.choice(8 * len(whole), size=200, replace=False):
        flip(path, int(bit))
        with pytest.raises(ArtifactError, match="damaged"):
            open_table(tmp_path, "selections")
        # The artifact went to `corrupt`; the next night makes it again.
        commit_sample(store, log, "a", tables=("selections",))
        assert path.read_bytes() == whole
    pd.testing.assert_frame_equal(open_table(tmp_path, "selections"), expected)
    assert verify(store.layout).findings == ()


def test_damage_of_every_kind_of_file_is_found_and_mended(store: LocalArtifactStore) -> None:
    layout = store.layout
    rng = np.random.default_rng(5)
    kinds = [
        *layout.objects.glob("*/*/*.parquet"),
        *layout.objects.glob("*/*/.manifest.json"),
        *layout.recipes.glob("*/*.json"),
        *layout.table_log.glob("*.json"),
        *layout.table_log.glob("copies/*.json"),
        *layout.registry.glob("*.json"),
    ]
    assert len(kinds) == 6 + 2 + 2 + 2 + 2 + 1
    for path in kinds:
        before = path.read_bytes()
        # A flipped bit in the spaces of a JSON file may change nothing that it says.
        places = [k for k, byte in enumerate(before) if path.suffix != ".json" or byte > 32]
        flip(path, 8 * int(rng.choice(places)) + int(rng.integers(8)))
        assert Damage.CORRUPT in verify(layout).damage, path
        verify(layout, repair=True)
        take_in_again(store)
        assert verify(layout).findings == ()
        for table in TABLES:
            assert len(pd.read_parquet(layout.table_folder(table))) == 6


def test_repair_takes_damaged_rows_out_of_sight_until_they_are_made_again(
    store: LocalArtifactStore,
) -> None:
    path = store.layout.table_folder("logs") / "a.parquet"
    flip(path, 8 * (path.stat().st_size - 20))
    found = verify(store.layout, repair=True)
    assert found.count(Damage.CORRUPT) == 1
    assert Damage.MISSING in found.damage
    assert set(pd.read_parquet(store.layout.table_folder("logs"))["log_id"]) == {
        "b-0",
        "b-1",
        "b-2",
    }
    assert store.find(recipe_of("a")) is None
    take_in_again(store)
    assert len(pd.read_parquet(store.layout.table_folder("logs"))) == 6


def test_a_copied_part_is_foreign_because_it_doubles_rows(store: LocalArtifactStore) -> None:
    folder = store.layout.table_folder("logs")
    (folder / "copy.parquet").write_bytes((folder / "a.parquet").read_bytes())
    assert len(pd.read_parquet(folder)) == 9
    assert verify(store.layout).damage is Damage.FOREIGN
    assert verify(store.layout, repair=True).damage is Damage.NONE
    assert len(pd.read_parquet(folder)) == 6


def test_a_part_that_is_not_shown_is_shown_again(store: LocalArtifactStore) -> None:
    (store.layout.table_folder("logs") / "a.parquet").unlink()
    assert verify(store.layout).damage is Damage.MISSING
    assert verify(store.layout, repair=True).damage is Damage.NONE
    assert len(pd.read_parquet(store.layout.table_folder("logs"))) == 6


def test_a_recipe_whose_artifact_is_gone_is_forgotten(store: LocalArtifactStore) -> None:
    ref = store.find(recipe_of("a"))
    assert ref is not None
    store.layout.object_folder(ref).rename(store.layout.root / "elsewhere")
    assert Damage.MISSING in verify(store.layout).damage
    verify(store.layout, repair=True)
    assert store.answer(recipe_of("a")) is None
    take_in_again(store)
    assert verify(store.layout).findings == ()


def test_a_log_damaged_in_both_files_is_refused_by_name(store: LocalArtifactStore) -> None:
    for path in (
        store.layout.table_log / "00000001.json",
        store.layout.table_log / "copies" / "00000001.json",
    ):
        path.write_bytes(b"{")
    with pytest.raises(ArtifactError, match=r"00000001\.json is damaged"):
        verify(store.layout)
