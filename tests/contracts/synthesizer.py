"""What every synthesizer keeps: shapes, seeds, no pickle, and the same samples after a reload."""

import io
from collections.abc import Callable

import numpy as np

from ses_core.navigation import NavigationDomain
from ses_core.protocols import FittedSynthesizer, Synthesizer
from ses_core.synthesis.factory import rebuild_synthesizer


def check_synthesizer(
    method: str, make: Callable[[], Synthesizer], domain: NavigationDomain
) -> None:
    """Fit to a domain twice and hold the seam's promises against the fits."""
    heard: list[float] = []
    fitted = make().fit(domain, rng=np.random.default_rng(5), progress=heard.append)
    again = make().fit(domain, rng=np.random.default_rng(5), progress=lambda _: None)
    _check_progress(heard)
    _check_samples(fitted, len(domain.environments))
    _check_same_seed_same_bytes(fitted, again)
    _check_reload(method, fitted)


def _check_progress(heard: list[float]) -> None:
    assert heard == sorted(heard)
    assert all(0.0 <= share <= 1.0 for share in heard)
    assert heard[-1] == 1.0


def _check_samples(fitted: FittedSynthesizer, available: int) -> None:
    for count in (1, available):
        cells = fitted.sample(count, rng=np.random.default_rng(1))
        assert cells.shape == (count, 30, 30)
        assert cells.dtype == np.bool_
    assert 0 < len(fitted.sample(10 * available, rng=np.random.default_rng(1))) <= 10 * available


def _check_same_seed_same_bytes(fitted: FittedSynthesizer, again: FittedSynthesizer) -> None:
    arrays, others = fitted.arrays(), again.arrays()
    assert arrays.keys() == others.keys()
    for name, array in arrays.items():
        assert array.dtype == others[name].dtype
        assert array.tobytes() == others[name].tobytes(), name
    first = fitted.sample(7, rng=np.random.default_rng(2))
    assert first.tobytes() == fitted.sample(7, rng=np.random.default_rng(2)).tobytes()


def _check_reload(method: str, fitted: FittedSynthesizer) -> None:
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **fitted.arrays())
    buffer.seek(0)
    with np.load(buffer, allow_pickle=False) as stored:
        reloaded = rebuild_synthesizer(method, {name: stored[name] for name in stored.files})
    expected = fitted.sample(20, rng=np.random.default_rng(3))
    assert np.array_equal(reloaded.sample(20, rng=np.random.default_rng(3)), expected)
