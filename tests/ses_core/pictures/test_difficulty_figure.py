import io

import numpy as np
from PIL import Image

from ses_core.pictures.difficulty_figure import draw_difficulty


def test_dots_follow_the_counts_and_the_threshold_shows() -> None:
    logged, simulated = np.array([60.0, 90.0, 300.0]), np.array([0.0, 80.0, 20.0])
    name = "steps with v < 0"
    pictures = [
        draw_difficulty(logged, simulated, threshold=50.0, count_name=name),
        draw_difficulty(logged, simulated[::-1], threshold=50.0, count_name=name),
        draw_difficulty(logged, simulated, threshold=0.0, count_name=name),
    ]
    assert len({Image.open(io.BytesIO(picture)).size for picture in pictures}) == 1
    assert len(set(pictures)) == 3


def test_a_single_place_without_any_count_is_drawn() -> None:
    picture = draw_difficulty(np.zeros(1), np.zeros(1), threshold=50.0, count_name="steps")
    assert Image.open(io.BytesIO(picture)).format == "PNG"
