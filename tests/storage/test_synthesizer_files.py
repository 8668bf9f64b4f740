from pathlib import Path

import numpy as np
import pytest
from numpy.random import default_rng

from ses_core.errors import ArtifactError
from ses_core.robot_profile import JACKAL
from ses_core.synthesis.synthesize import FittedSynthesis, draw_environments, fit_synthesis
from ses_core.synthesis_settings import (
    RandomSamplingSettings,
    SynthesisSettings,
    SynthesizerSettings,
)
from storage.synthesizer_files import ARRAYS_FILE, PLAN_FILE, read_synthesizer, write_synthesizer
from tests.ses_core.synthesis.places import QUICK_SYNTHESIZERS, domain_of, rooms

DOMAIN = domain_of(rooms(60))


def fitted(synthesizer: SynthesizerSettings) -> tuple[FittedSynthesis, SynthesisSettings]:
    settings = SynthesisSettings(synthesizer=synthesizer, environments=80)
    return fit_synthesis(
        DOMAIN, settings=settings, rng=default_rng(1), progress=lambda _: None
    ), settings


@pytest.mark.parametrize("synthesizer", QUICK_SYNTHESIZERS, ids=lambda item: item.method)
def test_reading_back_gives_the_same_plan_and_the_same_environments(
    synthesizer: SynthesizerSettings, tmp_path: Path
) -> None:
    original, settings = fitted(synthesizer)
    write_synthesizer(tmp_path, original)
    read = read_synthesizer(tmp_path)
    assert read.plan == original.plan
    results = [
        draw_environments(item, DOMAIN, settings=settings, target=JACKAL, rng=default_rng(2))
        for item in (original, read)
    ]
    ids = [[item.environment_id for item in result.environments.environments] for result in results]
    assert ids[0] == ids[1]


@pytest.mark.parametrize("synthesizer", QUICK_SYNTHESIZERS, ids=lambda item: item.method)
def test_equal_fits_are_equal_files(synthesizer: SynthesizerSettings, tmp_path: Path) -> None:
    folders = [tmp_path / "first", tmp_path / "second"]
    for folder in folders:
        folder.mkdir()
        write_synthesizer(folder, fitted(synthesizer)[0])
    for name in (ARRAYS_FILE, PLAN_FILE):
        assert (folders[0] / name).read_bytes() == (folders[1] / name).read_bytes()


@pytest.mark.parametrize("name", [ARRAYS_FILE, PLAN_FILE])
def test_a_missing_or_damaged_file_is_an_artifact_error(name: str, tmp_path: Path) -> None:
    write_synthesizer(tmp_path, fitted(RandomSamplingSettings())[0])
    content = (tmp_path / name).read_bytes()
    for damaged in (b"", content[: len(content) // 2], b"\x80\x04N."):
        (tmp_path / name).write_bytes(damaged)
        with pytest.raises(ArtifactError, match="holds no fitted synthesizer"):
            read_synthesizer(tmp_path)
    (tmp_path / name).unlink()
    with pytest.raises(ArtifactError, match="holds no fitted synthesizer"):
        read_synthesizer(tmp_path)


def test_pickled_arrays_are_never_loaded(tmp_path: Path) -> None:
    write_synthesizer(tmp_path, fitted(RandomSamplingSettings())[0])
    np.savez(tmp_path / ARRAYS_FILE, cells=np.array([{"a": 1}], dtype=object))
    with pytest.raises(ArtifactError, match="pickle"):
        read_synthesizer(tmp_path)
