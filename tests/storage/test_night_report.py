from dataclasses import replace

import pytest

from storage.night_report import Decision, NightReport, RefusedLog, headline
from tests.storage.nights import full_night, quiet_night, taken_log, untrained_night


def test_a_trained_night_says_how_the_policy_did_against_its_parent() -> None:
    words = headline(full_night()).replace("\N{NO-BREAK SPACE}", " ")
    assert "trained in 100 environments" in words
    assert "71 % of trials, the policy it came from in 68 %" in words
    assert words.endswith("insufficient evidence, nothing was promoted.")


def test_a_promoted_policy_is_called_the_champion() -> None:
    promoted = Decision(verdict="better", reasons=(), is_promoted=True)
    words = headline(replace(full_night(), decision=promoted))
    assert words.endswith("better, it is the champion now.")


@pytest.mark.parametrize("kept", ["rows", "comparisons", "nothing"])
def test_a_policy_that_was_not_measured_against_its_parent_is_not_praised(kept: str) -> None:
    night = full_night()
    assert night.evaluation is not None
    evaluation = {
        "rows": replace(night.evaluation, comparisons=()),
        "comparisons": replace(
            night.evaluation,
            comparisons=(replace(night.evaluation.comparisons[0], baseline="dwa-slow"),),
        ),
        "nothing": None,
    }[kept]
    words = headline(replace(night, evaluation=evaluation))
    assert "could not be measured against the one it came from" in words


def test_a_night_without_training_counts_its_logs() -> None:
    assert headline(untrained_night()) == "1 new log read, and no policy trained."
    two = replace(untrained_night(), logs=(taken_log(name="a"), taken_log(name="b")))
    assert headline(two) == "2 new logs read, and no policy trained."


def test_a_night_without_logs_says_so() -> None:
    assert headline(quiet_night()).startswith("No new logs came in")


def test_a_night_of_refused_logs_says_so() -> None:
    night: NightReport = replace(quiet_night(), refused=(RefusedLog(name="a", reason="empty"),))
    assert headline(night) == "1 log came in and none could be read."
