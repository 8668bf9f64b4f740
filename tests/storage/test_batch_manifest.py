from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest

from ses_core.errors import ArtifactError
from storage.batch_manifest import (
    LogRecord,
    RunRecord,
    StageRecord,
    batch_dates,
    make_run_id,
    read_manifest,
    record_run,
)
from storage.layout import Layout, open_layout

DAY = date(2026, 11, 22)
RUN = RunRecord(
    run_id="2026-11-22-0a0b0c0d",
    started_stamp_ns=1_700_000_000_000_000_000,
    seconds=12.5,
    logs=(
        LogRecord(name="a.bag", log_id="abc", status="new"),
        LogRecord(name="b.bag", log_id="def", status="quarantined", reason="truncated"),
    ),
    stages=(
        StageRecord(stage="ingest", built=1, found=2, seconds=3.25, artifacts=("ingest/abc",)),
    ),
    decision="insufficient evidence",
    champion="",
    summary={"scenarios": 3, "logs": {"new": 1}},
)


@pytest.fixture
def layout(tmp_path: Path) -> Layout:
    return open_layout(tmp_path)


def test_a_run_reads_back_equal(layout: Layout) -> None:
    written = record_run(layout, DAY, RUN)
    assert read_manifest(layout, DAY) == written
    assert written.runs == (RUN,)
    assert batch_dates(layout) == [DAY]


def test_runs_of_one_day_are_kept_and_a_repeated_one_replaced(layout: Layout) -> None:
    second = replace(RUN, run_id="2026-11-22-11111111")
    record_run(layout, DAY, RUN)
    record_run(layout, DAY, second)
    manifest = record_run(layout, DAY, replace(RUN, seconds=0.5))
    assert [run.run_id for run in manifest.runs] == [RUN.run_id, second.run_id]
    assert manifest.runs[0].seconds == 0.5


def test_a_day_without_a_night_has_no_manifest(layout: Layout) -> None:
    assert read_manifest(layout, DAY) is None


def test_a_damaged_manifest_is_named_and_does_not_stop_the_next_night(layout: Layout) -> None:
    record_run(layout, DAY, RUN)
    path = layout.batch_file(DAY)
    path.write_bytes(path.read_bytes().replace(b"truncated", b"truncatex"))
    with pytest.raises(ArtifactError, match=r"2026-11-22\.json is damaged"):
        read_manifest(layout, DAY)
    assert record_run(layout, DAY, RUN).runs == (RUN,)


def test_the_same_night_asked_again_has_the_same_name() -> None:
    assert make_run_id(DAY, ["a", "b"]) == make_run_id(DAY, ["a", "b"])
    assert make_run_id(DAY, ["a", "b"]) != make_run_id(DAY, ["b", "a"])
    assert make_run_id(DAY, ["a"]).startswith("2026-11-22-")
