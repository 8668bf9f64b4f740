"""Tests of an episode's columns and of BARN's score."""

from dataclasses import fields

import pytest

from ses_core.evaluation.episodes import Episode, barn_score, episode_columns
from ses_core.evaluation.outcomes import EpisodeOutcome
from tests.ses_core.evaluation.episode_lists import successes


@pytest.mark.parametrize(
    ("time", "score"), [(4.0, 0.5), (10.0, 0.5), (20.0, 0.25), (40.0, 0.125), (90.0, 0.125)]
)
def test_a_success_scores_between_an_eighth_and_a_half(time: float, score: float) -> None:
    assert barn_score(EpisodeOutcome.SUCCESS, time=time, optimal_time=5.0) == pytest.approx(score)


@pytest.mark.parametrize("outcome", ["COLLISION", "TIMEOUT", "STUCK"])
def test_a_failure_scores_nothing(outcome: str) -> None:
    assert barn_score(EpisodeOutcome[outcome], time=5.0, optimal_time=5.0) == 0.0


def test_columns_hold_every_field_in_the_order_of_the_episodes() -> None:
    columns = episode_columns(successes("a", [3.0, 4.0]))
    assert list(columns) == [column.name for column in fields(Episode)]
    assert columns["time_s"] == [3.0, 4.0]
