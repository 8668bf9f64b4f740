"""The picture of a log: the whole drive beside its places."""

import numpy as np

from ses_core.pictures.figures import LIGHT
from ses_core.pictures.log_figure import log_figure
from tests.ses_core.extraction.drives import CORRIDOR, scanned_drive
from tests.ses_core.pictures.pictured import draws, drive, extracted, pixels


def test_a_log_is_drawn_beside_its_places() -> None:
    drives = [drive(), drive(reversing=True)]
    found = extracted(*drives)
    picture = pixels(log_figure(found, drives, title="<home> & away"))
    assert draws(picture, LIGHT.occupied) > 1000
    assert draws(picture, LIGHT.series[2]) > 100
    many = log_figure(found * 9, drives, title="many")
    assert pixels(many).shape[1] > picture.shape[1]


def test_a_log_of_which_nothing_was_extracted_is_drawn_too() -> None:
    standing = scanned_drive(np.zeros((2, 2)), CORRIDOR, every=1)
    assert pixels(log_figure([], [standing], title="still")).size > 0
    assert pixels(log_figure([], [], title="nothing")).size > 0
