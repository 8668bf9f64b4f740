"""What every synthesizer keeps: shapes, seeds, no pickle, light draws, the same after a reload."""

import hashlib
import io
import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.random import default_rng

from ses_core.navigation import NavigationDomain
from ses_core.protocols import FittedSynthesizer, Synthesizer
from ses_core.synthesis.factory import rebuild_synthesizer


def check_synthesizer(
    method: str, make: Callable[[], Synthesizer], domain: NavigationDomain
) -> None:
    """Fit to a domain, from nothing and from an earlier fit, and hold the seam's promises."""
    heard: list[float] = []
    fitted = make().fit(domain, rng=default_rng(5), progress=heard.append)
    again = make().fit(domain, rng=default_rng(5), progress=lambda _: None)
    _check_progress(heard)
    _check_samples(fitted, len(domain.environments))
    _check_equal(fitted, again)
    _check_reload(method, fitted)
    _check_warm_start(method, make, domain, start=fitted)


def check_drawing_is_light(fits: Mapping[str, FittedSynthesizer], folder: Path) -> None:
    """Rebuild stored fits, by method, where torch and scikit-learn cannot be imported, and draw."""
    expected = {}
    for method, fitted in fits.items():
        np.savez(folder / f"{method}.npz", allow_pickle=False, **fitted.arrays())
        drawn = fitted.sample(30, rng=default_rng(3))
        expected[method] = hashlib.sha256(drawn.tobytes()).hexdigest()
    answer = subprocess.run(
        [sys.executable, "-c", _DRAW, str(folder), *fits],
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 0, answer.stderr
    assert json.loads(answer.stdout) == expected


_DRAW = """
import hashlib, json, pathlib, sys
sys.modules["torch"] = sys.modules["sklearn"] = None
import numpy as np
import ses_core.synthesis.synthesize
from ses_core.synthesis.factory import rebuild_synthesizer

drawn = {}
for method in sys.argv[2:]:
    with np.load(pathlib.Path(sys.argv[1], f"{method}.npz"), allow_pickle=False) as stored:
        fitted = rebuild_synthesizer(method, {name: stored[name] for name in stored.files})
    cells = fitted.sample(30, rng=np.random.default_rng(3))
    drawn[method] = hashlib.sha256(cells.tobytes()).hexdigest()
print(json.dumps(drawn))
"""


def _check_progress(heard: list[float]) -> None:
    assert heard == sorted(heard)
    assert all(0.0 <= share <= 1.0 for share in heard)
    assert heard[-1] == 1.0


def _check_samples(fitted: FittedSynthesizer, available: int) -> None:
    most = len(fitted.sample(10 * available, rng=default_rng(1)))
    assert 0 < most <= 10 * available
    for count in (1, available // 2, available):
        cells = fitted.sample(count, rng=default_rng(1))
        assert cells.shape == (min(count, most), 30, 30)
        assert cells.dtype == np.bool_


def _check_equal(fitted: FittedSynthesizer, again: FittedSynthesizer) -> None:
    arrays, others = fitted.arrays(), again.arrays()
    assert arrays.keys() == others.keys()
    for name, array in arrays.items():
        assert array.dtype == others[name].dtype
        assert array.tobytes() == others[name].tobytes(), name
    first = fitted.sample(7, rng=default_rng(2))
    for other in (fitted, again):
        assert first.tobytes() == other.sample(7, rng=default_rng(2)).tobytes()


def _check_reload(method: str, fitted: FittedSynthesizer) -> None:
    reloaded = _reloaded(method, fitted)
    _check_equal(fitted, reloaded)
    expected = fitted.sample(20, rng=default_rng(3))
    assert np.array_equal(reloaded.sample(20, rng=default_rng(3)), expected)


def _check_warm_start(
    method: str,
    make: Callable[[], Synthesizer],
    domain: NavigationDomain,
    *,
    start: FittedSynthesizer,
) -> None:
    """Start from a fit and from what a store gives back of it: the same bytes, start untouched."""
    before = {name: array.tobytes() for name, array in start.arrays().items()}
    warm, again = (
        make().fit(domain, rng=default_rng(6), progress=lambda _: None, start=earlier)
        for earlier in (start, _reloaded(method, start))
    )
    _check_equal(warm, again)
    assert {name: array.tobytes() for name, array in start.arrays().items()} == before


def _reloaded(method: str, fitted: FittedSynthesizer) -> FittedSynthesizer:
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **fitted.arrays())
    buffer.seek(0)
    with np.load(buffer, allow_pickle=False) as stored:
        return rebuild_synthesizer(method, {name: stored[name] for name in stored.files})
