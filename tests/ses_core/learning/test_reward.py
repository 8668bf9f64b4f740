"""Tests of the reward."""

import numpy as np

from ses_core.evaluation.outcomes import EpisodeOutcome
from ses_core.learning.reward import rewards


def test_every_ending_has_its_reward() -> None:
    outcomes = np.array(list(EpisodeOutcome))
    given = rewards(np.full(5, 3.0), np.full(5, 2.5), outcomes, failure_penalty=7.0)
    assert [outcome.name for outcome in EpisodeOutcome] == [
        "RUNNING",
        "SUCCESS",
        "COLLISION",
        "TIMEOUT",
        "STUCK",
    ]
    assert given.tolist() == [0.5, 20.5, -6.5, -6.5, -6.5]


def test_going_away_costs_what_coming_back_earns() -> None:
    running = np.zeros(1, dtype=np.int64)
    away = rewards(np.array([1.0]), np.array([4.0]), running, failure_penalty=20.0)
    back = rewards(np.array([4.0]), np.array([1.0]), running, failure_penalty=20.0)
    assert away + back == 0.0
