import subprocess
import sys

import numpy as np
import pytest

from ses_core.errors import SynthesisError
from ses_core.synthesis.factory import make_synthesizer, rebuild_synthesizer
from ses_core.synthesis_settings import (
    GanSettings,
    IdentitySettings,
    PcaSettings,
    RandomSamplingSettings,
    SynthesizerSettings,
)
from tests.contracts.synthesizer import check_synthesizer
from tests.ses_core.synthesis.places import domain_of, rooms


@pytest.mark.parametrize(
    "settings",
    [
        GanSettings(epochs=2, least_updates=6),
        PcaSettings(components=12),
        RandomSamplingSettings(),
        IdentitySettings(),
    ],
    ids=lambda item: item.method,
)
def test_every_synthesizer_keeps_the_contract(settings: SynthesizerSettings) -> None:
    check_synthesizer(
        settings.method,
        lambda: make_synthesizer(settings, environments=20),
        domain_of(rooms(40)),
    )


def test_an_unknown_method_is_named() -> None:
    with pytest.raises(SynthesisError, match="'dream', expected one of gan, pca, rs, identity"):
        rebuild_synthesizer("dream", {})


@pytest.mark.parametrize("method", ["gan", "pca", "rs", "identity"])
def test_a_missing_array_is_named(method: str) -> None:
    with pytest.raises(SynthesisError, match=f"among those of {method}"):
        rebuild_synthesizer(method, {"other": np.zeros(1)})


def test_drawing_from_a_stored_generator_needs_no_torch() -> None:
    program = (
        "import sys; import ses_core.synthesis.synthesize, ses_core.synthesis.generator_network;"
        "print([name for name in ('torch', 'sklearn') if name in sys.modules])"
    )
    output = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert output.stdout.strip() == "[]"
