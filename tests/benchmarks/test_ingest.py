"""Both sides of the comparison of decoders give the same numbers, whatever holds the messages."""

import runpy
from pathlib import Path

import pytest

from tests.log_factory import LOG_KINDS, drive, write_log

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.parametrize("kind", ["bag", "bag-bz2", "bag-lz4", "db3", "mcap", "mcap-storage"])
def test_both_decoders_give_equal_numbers(tmp_path: Path, kind: str) -> None:
    assert kind in LOG_KINDS
    require_equal = runpy.run_path(str(BENCHMARKS / "ingest.py"))["_require_equal"]
    bag, _ = write_log(tmp_path, kind, drive(6.0))
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    # Odometry at 20 Hz, commands at 10 Hz, scans at 5 Hz.
    assert require_equal(bag, scratch) == 121 + 61 + 30


def test_a_difference_between_the_decoders_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = runpy.run_path(str(BENCHMARKS / "ingest.py"))
    ours = bench["_our_columns"]

    def off_by_one(streams: object) -> dict[str, object]:
        columns: dict[str, object] = ours(streams)
        return {**columns, "measured": columns["measured"] + 1.0}  # type: ignore[operator]

    monkeypatch.setitem(bench["_require_equal"].__globals__, "_our_columns", off_by_one)
    bag, _ = write_log(tmp_path, "mcap", drive(2.0))
    with pytest.raises(ValueError, match="measured differs"):
        bench["_require_equal"](bag, tmp_path)
