"""Generated worlds against what was measured once of real ones: figures only, no data.

Both tables are what `ses bench worlds` measures: of BARN's 300 worlds and paths, and of the
paper's 50 furnished houses (deployment and tuning parts).
"""

import runpy
from pathlib import Path

import numpy as np
import pytest

from ses_core.worlds.cellular_automata import generate_barn
from ses_core.worlds.homes import generate_homes

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"

SHARES = (0.1, 0.25, 0.5, 0.75, 0.9)
BARN_QUANTILES = {
    "closest obstacle": (1.489, 1.718, 2.120, 2.785, 3.543),
    "visibility": (3.139, 3.537, 4.393, 5.768, 7.341),
    "dispersion": (3.000, 3.722, 4.240, 4.655, 4.933),
    "characteristic dimension": (1.517, 2.148, 3.300, 5.394, 8.413),
    "tortuosity": (1.071, 1.099, 1.168, 1.264, 1.421),
    "path length": (31.485, 32.899, 34.971, 38.824, 43.220),
    "fill": (0.113, 0.134, 0.182, 0.237, 0.267),
}
"""At these shares of the 300 originals; lengths in cells."""

HOUSES_10_90 = {
    "free area [m2]": (48.4, 398.7),
    "long side [m]": (12.5, 39.9),
    "short side [m]": (7.4, 28.5),
    "free fraction": (0.26, 0.53),
    "standing fraction": (0.05, 0.40),
    "obstacles per 100 m2": (6.5, 20.4),
    "mean clearance [m]": (0.26, 0.54),
    "width 50 % [m]": (0.57, 1.01),
    "width 90 % [m]": (1.32, 2.68),
    "path clearance [m]": (0.53, 0.87),
    "bottleneck [m]": (0.93, 1.42),
    "path over straight": (1.04, 1.24),
}


def test_generated_barn_worlds_measure_like_the_originals(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    barn = runpy.run_path(str(BENCHMARKS / "_barn_measures.py"))
    points = np.array(
        [barn["barn_measures"](each.field, each.path) for each in generate_barn(96, seed=0)]
    )
    for name, quantiles in BARN_QUANTILES.items():
        values = points[:, barn["MEASURES"].index(name)]
        reached = [float((values <= quantile + 1e-3).mean()) for quantile in quantiles]
        # A share among 96 draws has a standard deviation of 0.05 at most.
        assert reached == pytest.approx(SHARES, abs=0.12), name


def test_barns_measures_of_a_field_that_can_be_measured_by_hand(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    barn = runpy.run_path(str(BENCHMARKS / "_barn_measures.py"))
    field = np.zeros((30, 30), dtype=np.bool_)
    field[[0, -1]] = True
    # The robot's configuration space is free in rows 3 to 26: straight along row 5.
    path = np.array([(5, column) for column in range(30)])
    measured = dict(zip(barn["MEASURES"], barn["barn_measures"](field, path), strict=True))
    assert measured["closest obstacle"] == 3.0
    # Up or down the row in front of the wall is 2 or 21 cells off, slantwise no nearer.
    assert 2.0 < measured["characteristic dimension"] <= 23.0
    assert measured["tortuosity"] == 1.0
    assert measured["path length"] == 29.0
    assert measured["fill"] == pytest.approx(60 / 900)
    # Within three rows of the wall it shows as one block of rays: two changes.
    assert measured["dispersion"] == pytest.approx(2.0, abs=0.2)


def test_homes_measure_like_furnished_houses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    statistics = runpy.run_path(str(BENCHMARKS / "_home_statistics.py"))["home_statistics"]
    measured = [statistics(home, pairs=2, seed=0) for home in generate_homes(10, seed=0)]
    assert all(np.isfinite(home["bottleneck [m]"]) for home in measured)
    for name, (low, high) in HOUSES_10_90.items():
        assert low <= np.median([home[name] for home in measured]) <= high, name
