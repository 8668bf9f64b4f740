"""Tests of the picture of a learning curve."""

import pytest

from ses_core.learning.training_curve import CurvePoint
from ses_core.pictures.figures import DARK
from ses_core.pictures.learning_curve import draw_learning_curve


def point(steps: int, success_rate: float, time: float | None) -> CurvePoint:
    return CurvePoint(
        steps=steps,
        episodes=20,
        mean_return=10.0,
        success_rate=success_rate,
        collision_rate=0.1,
        mean_time_s=time,
    )


CURVE = [point(100, 0.0, None), point(200, 0.5, 30.0), point(300, 0.9, 20.0)]


def test_equal_curves_are_equal_pictures_and_others_are_not() -> None:
    picture = draw_learning_curve(CURVE)
    assert picture.startswith(b"\x89PNG")
    assert picture == draw_learning_curve(CURVE)
    assert picture != draw_learning_curve([*CURVE[:2], point(300, 0.6, 20.0)])
    assert picture != draw_learning_curve(CURVE, theme=DARK)


def test_a_training_without_a_success_can_be_drawn() -> None:
    assert draw_learning_curve([point(100, 0.0, None)]).startswith(b"\x89PNG")


def test_an_empty_curve_is_refused() -> None:
    with pytest.raises(ValueError, match="0 points"):
        draw_learning_curve([])
