"""Tests of the pictures of an evaluation."""

import pytest

from ses_core.evaluation.statistics import summarize
from ses_core.pictures.evaluation_figure import draw_evaluation, draw_worlds
from tests.ses_core.evaluation.episode_lists import episode, successes

EPISODES = [*successes("new", [10.0, 20.0]), *successes("old", [30.0, 60.0])]
WORSE = [*EPISODES[:3], episode("old", "world-1", "stuck", 50.0)]


def test_pictures_show_what_the_episodes_say() -> None:
    picture = draw_evaluation(summarize(EPISODES))
    assert picture.startswith(b"\x89PNG")
    assert picture == draw_evaluation(summarize(EPISODES))
    assert picture != draw_evaluation(summarize(WORSE))
    assert draw_worlds(EPISODES) != draw_worlds(WORSE)


def test_one_world_without_an_interval_can_be_drawn() -> None:
    assert draw_evaluation(summarize(successes("new", [10.0]))).startswith(b"\x89PNG")


def test_many_worlds_fit_on_one_picture() -> None:
    assert draw_worlds(successes("new", [10.0] * 90)).startswith(b"\x89PNG")


def test_nothing_to_draw_is_refused() -> None:
    with pytest.raises(ValueError, match="0 policies"):
        draw_evaluation([])
    with pytest.raises(ValueError, match="0 episodes"):
        draw_worlds([])
