import logging

import pytest

from tasks.progress import INTERVAL_S, report_progress


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture(autouse=True)
def _hear_everything(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, logger="prefect.ses")


def shares(caplog: pytest.LogCaptureFixture) -> list[float]:
    return [round(record.share, 3) for record in caplog.records if hasattr(record, "share")]


def test_a_stage_that_is_done_at_once_says_nothing(caplog: pytest.LogCaptureFixture) -> None:
    progress = report_progress("train", clock=Clock())

    for share in (0.0, 0.5, 1.0):
        progress(share)

    assert shares(caplog) == []


def test_progress_is_told_at_most_once_per_interval_and_at_the_end(
    caplog: pytest.LogCaptureFixture,
) -> None:
    clock = Clock()
    progress = report_progress("train", clock=clock)

    for share in (0.1, 0.2, 0.3, 0.4):
        clock.now += 0.6 * INTERVAL_S
        progress(share)
    progress(1.0)

    assert shares(caplog) == [0.2, 0.4, 1.0]
    assert caplog.records[-1].getMessage() == "train 100 %"


def test_shares_out_of_range_are_kept_within(caplog: pytest.LogCaptureFixture) -> None:
    clock = Clock()
    progress = report_progress("train", clock=clock)

    clock.now += INTERVAL_S
    progress(1.7)

    assert shares(caplog) == [1.0]
