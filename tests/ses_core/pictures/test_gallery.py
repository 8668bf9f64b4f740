import io

import numpy as np
import pytest
from PIL import Image

from ses_core.pictures.figures import LIGHT
from ses_core.pictures.gallery import contact_sheet, packed_places
from tests.ses_core.synthesis.places import rooms


def pixels(png: bytes) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def color(text: str) -> tuple[int, ...]:
    return tuple(bytes.fromhex(text[1:]))


def test_packed_places_unpack_to_their_cells() -> None:
    noise = np.random.default_rng(0).random((2, 5, 30, 30)) < 0.5
    packed = np.frombuffer(packed_places(noise[0], noise[1]), dtype=np.uint8)
    assert len(packed) == 5 * 226
    bits = np.unpackbits(packed.reshape(5, 2, 113), axis=2)
    assert not bits[:, :, 900:].any()
    assert np.array_equal(bits[:, 0, :900].reshape(5, 30, 30), noise[0])
    assert np.array_equal(bits[:, 1, :900].reshape(5, 30, 30), noise[1])


def test_contact_sheet_shows_every_environment_in_its_place() -> None:
    cells = rooms(13, seed=2)
    image = pixels(contact_sheet(cells, np.ones_like(cells), columns=5))
    occupied = (image == color(LIGHT.occupied)).all(axis=2)
    assert image.shape[:2] == (14 + 3 * 134 + 7, 5 * 134 + 14)
    for index, place in enumerate(cells):
        top, left = 14 + 134 * (index // 5), 14 + 134 * (index % 5)
        drawn = occupied[top + 10 : top + 110, left + 2 : left + 120 : 4]
        # Row 0 and the last rows carry the dots of goal and start.
        expected = place[3:27].repeat(4, axis=0)
        assert np.array_equal(drawn[2:98], expected)


def test_contact_sheet_is_the_same_every_time() -> None:
    cells = rooms(3)
    sheets = [
        contact_sheet(cells, cells, captions=["51", "60", "99"], title="three") for _ in range(2)
    ]
    assert sheets[0] == sheets[1]


def test_contact_sheet_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="no environment"):
        contact_sheet(rooms(0), rooms(0))


def test_captions_have_to_match() -> None:
    with pytest.raises(ValueError, match="1 captions, expected 2"):
        contact_sheet(rooms(2), rooms(2), captions=["only one"])
