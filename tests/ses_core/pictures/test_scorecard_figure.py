import io

import numpy as np
import pytest
from PIL import Image

from ses_core.pictures.scorecard_figure import draw_scorecard
from tests.ses_core.scorecard.samples import pillars, score


def test_distributions_are_drawn_and_a_difference_shows() -> None:
    real = pillars(12, seed=0)
    same, other = score(real, real), score(real, pillars(12, seed=1, least=15, most=20))
    pictures = [draw_scorecard(one.rows, one.measures) for one in (same, other)]
    sizes = {Image.open(io.BytesIO(picture)).size for picture in pictures}
    assert len(sizes) == 1
    assert pictures[0] != pictures[1]


def test_nothing_at_all_is_drawn_as_too_few_and_no_measure_refused() -> None:
    nothing = score(np.zeros((0, 30, 30), np.bool_), np.zeros((0, 30, 30), np.bool_))
    assert Image.open(io.BytesIO(draw_scorecard(nothing.rows, nothing.measures))).size[0] > 1000
    with pytest.raises(ValueError, match="0 measures, expected at least 1"):
        draw_scorecard((), {})
