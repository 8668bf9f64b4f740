from datetime import date
from pathlib import Path

import pytest

from ses_core.errors import ArtifactError
from ses_core.recipes import ArtifactRef
from storage.artifact_store import LocalArtifactStore
from storage.layout import STORE_FORMAT, Layout, open_layout


def test_a_store_of_a_newer_release_is_refused_with_its_version(tmp_path: Path) -> None:
    open_layout(tmp_path).store_file.unlink()
    (tmp_path / "store.json").write_text('{"format": 7}')
    with pytest.raises(ArtifactError, match=rf"format 7, this release knows .* {STORE_FORMAT}"):
        LocalArtifactStore(tmp_path)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "new"}'])
def test_a_root_that_does_not_say_its_format_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "store.json").write_text(text)
    with pytest.raises(ArtifactError, match="does not say which format"):
        open_layout(tmp_path)


def test_opening_twice_changes_nothing(tmp_path: Path) -> None:
    before = open_layout(tmp_path).store_file.stat().st_mtime_ns
    assert open_layout(tmp_path).store_file.stat().st_mtime_ns == before


def test_a_root_that_is_a_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "root").write_text("")
    with pytest.raises(ArtifactError, match=r"root.*bytes free"):
        open_layout(tmp_path / "root")


def test_everything_lies_under_the_root() -> None:
    layout = Layout(Path("/somewhere"))
    ref = ArtifactRef("extract", "abc")
    assert layout.object_folder(ref) == Path("/somewhere/objects/extract/abc")
    assert layout.recipe_file("extract", "key") == Path("/somewhere/recipes/extract/key.json")
    assert layout.table_folder("logs") == Path("/somewhere/tables/logs")
    assert layout.batch_file(date(2026, 11, 22)) == Path("/somewhere/batches/2026-11-22.json")
    page = layout.report_page(date(2026, 11, 22))
    assert page == Path("/somewhere/report/2026-11-22/index.html")
