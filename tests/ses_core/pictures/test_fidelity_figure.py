import io

import numpy as np
from PIL import Image

from ses_core.pictures.fidelity_figure import fidelity_figure
from tests.ses_core.evaluation.episode_lists import successes


def test_two_sides_of_trials_are_drawn_and_a_difference_shows() -> None:
    batch = successes("dwa-slow", [10.0, 20.0])
    bullet = successes("dwa-slow", [11.0, 30.0])
    errors = {"straight": np.array([0.01, 0.02]), "arc": np.array([0.03, 0.04])}
    picture, other = fidelity_figure(errors, batch, bullet), fidelity_figure(errors, batch, batch)
    assert Image.open(io.BytesIO(picture)).size == (1320, 440)
    assert picture != other
