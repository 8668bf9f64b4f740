"""Going on from an earlier fit, and beginning from nothing where that cannot be."""

import numpy as np
import pytest
from numpy.random import default_rng

from ses_core.synthesis.sizes import SynthesisPlan
from ses_core.synthesis.synthesize import EarlierFit, FittedSynthesis, fit_synthesis, is_training
from ses_core.synthesis_settings import (
    AutoregressiveSettings,
    GanPaperSettings,
    GanSettings,
    IdentitySettings,
    RandomSamplingSettings,
    SynthesisSettings,
    SynthesizerSettings,
)
from tests.ses_core.synthesis.counted_fits import CountedFit, count_fits
from tests.ses_core.synthesis.places import domain_of, rooms

SETTINGS = SynthesisSettings(synthesizer=GanSettings(), environments=10)


@pytest.fixture(autouse=True)
def _counted(monkeypatch: pytest.MonkeyPatch) -> None:
    count_fits(monkeypatch)


def fit(start: EarlierFit | None = None) -> FittedSynthesis:
    return fit_synthesis(
        domain_of(rooms(40)),
        settings=SETTINGS,
        rng=default_rng(3),
        progress=lambda _: None,
        start=start,
    )


def earlier(synthesizer: SynthesizerSettings, weights: int) -> EarlierFit:
    plan = SynthesisPlan(synthesizer=synthesizer, environments=10)
    fitted = FittedSynthesis(plan=plan, synthesizer=CountedFit(np.zeros(weights), 6))
    return EarlierFit(name="ab12", fitted=fitted)


def fits_in(fitted: FittedSynthesis) -> int:
    return int(fitted.synthesizer.arrays()["fits"].astype(np.int64))


def test_a_fit_goes_on_from_an_earlier_one_and_says_so() -> None:
    warm = fit(earlier(GanSettings(), 3))
    assert fits_in(warm) == 7
    assert warm.plan.notes == ("went on from the earlier fit ab12",)


def test_what_does_not_match_is_begun_from_nothing_and_said() -> None:
    begun, cold = fit(earlier(GanSettings(epochs=7), 3)), fit()
    assert fits_in(begun) == fits_in(cold) == 1
    weights = [one.synthesizer.arrays()["weights"] for one in (begun, cold)]
    assert np.array_equal(weights[0], weights[1])
    assert begun.plan.notes == ("began from nothing: the earlier fit ab12 does not match",)
    assert cold.plan.notes == ()


@pytest.mark.parametrize(
    ("synthesizer", "available", "expected"),
    [
        (GanSettings(), 30, True),
        (GanPaperSettings(), 30, True),
        (AutoregressiveSettings(), 30, True),
        (GanSettings(), 29, False),
        (RandomSamplingSettings(), 30, False),
        (IdentitySettings(), 30, False),
    ],
)
def test_only_a_training_is_training(
    synthesizer: SynthesizerSettings, available: int, expected: bool
) -> None:
    settings = SynthesisSettings(synthesizer=synthesizer)
    assert is_training(settings, available=available) is expected
