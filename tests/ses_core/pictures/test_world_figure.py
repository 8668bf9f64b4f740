import io

import numpy as np
from PIL import Image

from ses_core.pictures.world_figure import world_sheet
from ses_core.robot_profile import JACKAL
from ses_core.worlds.homes import generate_homes
from ses_core.worlds.pairs import sample_tasks


def test_a_sheet_shows_walls_floor_and_pairs() -> None:
    homes = generate_homes(2, seed=0)
    rng = np.random.default_rng(0)
    tasks = {homes[0].world_id: sample_tasks(homes[0], 2, profile=JACKAL, rng=rng)}
    plain, paired = (_pixels(world_sheet(homes, tasks=given)) for given in (None, tasks))
    wall, goal = (0x2F, 0x34, 0x37), (0xD5, 0x5E, 0x00)
    assert np.all(plain == wall, axis=-1).mean() > 0.05
    assert not np.all(plain == goal, axis=-1).any()
    assert np.all(paired == goal, axis=-1).any()


def test_only_the_first_worlds_are_drawn() -> None:
    homes = generate_homes(3, seed=0)
    assert _pixels(world_sheet(homes, limit=1)).shape[1] < _pixels(world_sheet(homes)).shape[1]


def _pixels(picture: bytes) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    with Image.open(io.BytesIO(picture)) as image:
        return np.asarray(image.convert("RGB"))
