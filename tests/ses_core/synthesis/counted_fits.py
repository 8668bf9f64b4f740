"""A synthesizer in the GAN's place that learns nothing and counts the fits behind a fit."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.random import Generator
from numpy.typing import NDArray

from ses_core.arrays import BoolArray, FloatArray
from ses_core.navigation import NavigationDomain
from ses_core.protocols import FittedSynthesizer, Synthesizer
from ses_core.synthesis import factory
from ses_core.synthesis_settings import GanSettings, SynthesizerSettings


@dataclass(frozen=True)
class CountedFit:
    """Some weights, and how many fits went into them."""

    weights: FloatArray
    fits: int

    @property
    def is_endless(self) -> bool:
        return True

    def sample(self, count: int, *, rng: Generator, radius: float | None = None) -> BoolArray:
        return rng.random((count, 30, 30)) < 0.01

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        return {"weights": self.weights, "fits": np.array(self.fits)}


@dataclass(frozen=True)
class FitCounter:
    """Draws three weights, and counts on from where it starts."""

    def fit(
        self,
        domain: NavigationDomain,
        *,
        rng: Generator,
        progress: Callable[[float], None],
        start: FittedSynthesizer | None = None,
    ) -> CountedFit:
        progress(1.0)
        done = start.fits if isinstance(start, CountedFit) else 0
        return CountedFit(rng.random(3) + len(domain.environments), done + 1)


def count_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put it in the GAN's place: fitted, stored and rebuilt."""

    def make_counted(settings: SynthesizerSettings, *, environments: int) -> Synthesizer:
        if isinstance(settings, GanSettings):
            return FitCounter()
        return factory.make_synthesizer(settings, environments=environments)

    def rebuild(arrays: Mapping[str, NDArray[np.generic]]) -> CountedFit:
        return CountedFit(
            np.asarray(arrays["weights"], dtype=np.float64),
            int(np.asarray(arrays["fits"], dtype=np.int64)),
        )

    monkeypatch.setattr("ses_core.synthesis.synthesize.make_synthesizer", make_counted)
    monkeypatch.setitem(factory._REBUILDERS, "gan", rebuild)
