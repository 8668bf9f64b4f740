from pathlib import Path

import numpy as np
import pytest
from numpy.random import default_rng

from ses_core.errors import SynthesisError
from ses_core.protocols import FittedSynthesizer
from ses_core.synthesis.factory import make_synthesizer, rebuild_synthesizer
from ses_core.synthesis_settings import SynthesizerSettings
from tests.contracts.synthesizer import check_drawing_is_light, check_synthesizer
from tests.ses_core.synthesis.places import QUICK_SYNTHESIZERS, domain_of, rooms

METHODS = tuple(settings.method for settings in QUICK_SYNTHESIZERS)


@pytest.mark.parametrize("settings", QUICK_SYNTHESIZERS, ids=lambda item: item.method)
def test_every_synthesizer_keeps_the_contract(settings: SynthesizerSettings) -> None:
    check_synthesizer(
        settings.method,
        lambda: make_synthesizer(settings, environments=20),
        domain_of(rooms(40)),
    )


def test_drawing_from_what_is_stored_needs_no_heavy_library(tmp_path: Path) -> None:
    fits: dict[str, FittedSynthesizer] = {
        settings.method: make_synthesizer(settings, environments=20).fit(
            domain_of(rooms(40)), rng=default_rng(0), progress=lambda _: None
        )
        for settings in QUICK_SYNTHESIZERS
    }
    check_drawing_is_light(fits, tmp_path)


def test_an_unknown_method_is_named() -> None:
    expected = f"'dream', expected one of {', '.join(METHODS)}"
    with pytest.raises(SynthesisError, match=expected):
        rebuild_synthesizer("dream", {})


@pytest.mark.parametrize("method", METHODS)
def test_a_missing_array_is_named(method: str) -> None:
    with pytest.raises(SynthesisError, match=f"among those of {method}"):
        rebuild_synthesizer(method, {"other": np.zeros(1)})
