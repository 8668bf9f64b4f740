"""The comparison of simulators, at a size that shows that it runs and not how fast."""

import runpy
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.timeout(900)  # a fresh checkout compiles all kernels here, beside other tests
def test_every_promise_has_a_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    measure = runpy.run_path(str(BENCHMARKS / "simulators.py"))["measure"]

    rows = measure(tmp_path, worlds=2, many=4, few=2, houses=1, ticks=4, rounds=1, peer_ticks=4)

    names = [row["name"] for row in rows]
    assert names[:7] == [
        "batch-vs-pybullet-mesh",
        "batch-vs-pybullet-mesh, sensing at 5 Hz",
        "batch-vs-ir-sim",
        "batch-vs-ir-sim, sensing at 5 Hz",
        "two-threads-vs-one",
        "cost per world of 4 worlds over 2",
        "houses of 30 x 40 m over places of 5 m",
    ]
    kernels = [name.removeprefix("kernel: ") for name in names if name.startswith("kernel: ")]
    assert kernels == [
        *("lidar", "noise", "marks", "distances", "plan"),
        *("window", "local maps", "samples", "motion"),
    ]
    assert names[-1].startswith("costliest kernel: ")
    assert all(row["ours"] > 0.0 and row["theirs"] > 0.0 for row in rows)
