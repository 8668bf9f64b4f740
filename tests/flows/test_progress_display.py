import io
import logging
import sys

import pytest

from flows.progress_display import LINE_INTERVAL_S, ConsoleHandler, ProgressDisplay
from ses_core.errors import LogError


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_elsewhere_than_on_a_terminal_progress_is_a_line_now_and_then(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [0.0]
    monkeypatch.setattr("flows.progress_display.time.monotonic", lambda: now[0])
    stream = io.StringIO()
    display = ProgressDisplay(stream)

    for share in (0.1, 0.2, 0.3):
        display.update("train", share)
        now[0] += 0.6 * LINE_INTERVAL_S
    display.update("train", 1.0)

    assert stream.getvalue() == "train 10 %\ntrain 30 %\ntrain 100 %\n"


def test_a_terminal_gets_a_bar_that_goes_when_the_stage_is_done() -> None:
    stream = Terminal()
    display = ProgressDisplay(stream)

    display.update("train", 0.5)
    display.line("a line beside the bar")
    display.update("train", 1.0)
    display.line("after")

    text = stream.getvalue()
    assert "train" in text
    assert "50%" in text
    assert "a line beside the bar" in text
    assert text.endswith("after\n")


def record(error: BaseException) -> logging.LogRecord:
    try:
        raise error
    except type(error):
        return logging.LogRecord("prefect", logging.ERROR, "f", 1, "failed", (), sys.exc_info())


def test_a_foreseen_error_shows_no_traceback_and_a_surprise_does() -> None:
    stream = io.StringIO()
    handler = ConsoleHandler(stream)

    handler.emit(record(LogError("empty", "nothing in it")))
    foreseen = stream.getvalue()
    handler.emit(record(ZeroDivisionError("surprise")))

    assert foreseen == "failed\n"
    assert "Traceback" in stream.getvalue()


def test_records_with_a_share_move_the_bar_of_their_stage() -> None:
    stream = io.StringIO()
    handler = ConsoleHandler(stream)
    told = logging.LogRecord("prefect", logging.INFO, "f", 1, "whatever", (), None)
    told.stage, told.share = "fit", 0.25

    handler.emit(told)

    assert stream.getvalue() == "fit 25 %\n"


def test_lines_that_only_say_that_all_is_well_are_not_shown() -> None:
    stream = io.StringIO()
    handler = ConsoleHandler(stream)
    for message in (
        "Finished in state Completed()",
        "took in r1.mcap",
        "Finished in state Failed()",
    ):
        handler.emit(logging.LogRecord("ses", logging.INFO, "", 0, message, None, None))
    assert stream.getvalue().splitlines() == ["took in r1.mcap", "Finished in state Failed()"]
