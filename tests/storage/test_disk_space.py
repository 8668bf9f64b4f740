import os
from pathlib import Path

import pytest

from ses_core.errors import ArtifactError
from storage.disk_space import free_bytes, require_free_space


def test_a_floor_above_what_is_free_is_refused_with_both_numbers(tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match=rf"{tmp_path} has \d+ bytes free, .* {2**62}"):
        require_free_space(tmp_path, 2**62)


def test_a_floor_of_nothing_is_always_met(tmp_path: Path) -> None:
    require_free_space(tmp_path, 0)


def test_a_folder_yet_to_be_made_has_the_space_of_the_one_it_will_lie_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Path] = []
    original = os.statvfs

    def record(path: Path) -> os.statvfs_result:
        asked.append(path)
        return original(path)

    monkeypatch.setattr(os, "statvfs", record)
    assert free_bytes(tmp_path / "a" / "b") > 0
    assert asked == [tmp_path]
