import io

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from ses_core.occupancy import OccupancyGrid
from ses_core.pictures.world_figure import draw_world, world_sheet
from ses_core.robot_profile import JACKAL
from ses_core.worlds.homes import generate_homes
from ses_core.worlds.identity import named_world
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


def test_a_large_world_is_thinned_out_whole() -> None:
    cells = np.zeros((1203, 1203), dtype=np.bool_)
    cells[:, -1] = True
    cells[-1] = True
    world = named_world("large", OccupancyGrid(cells=cells, resolution=0.05), source="test")
    axes = Figure().add_subplot()
    draw_world(axes, world)
    (image,) = axes.images
    drawn = np.asarray(image.get_array())
    assert max(drawn.shape) <= 400
    assert drawn[:-1, -1].all()
    assert drawn[-1, :-1].all()
    assert not drawn[:-1, :-1].any()
    left, right, bottom, top = axes.axis()
    assert (right - left, top - bottom) == pytest.approx((60.15, 60.15))


def test_a_world_without_pairs_says_so() -> None:
    homes = generate_homes(1, seed=0)
    # Small letters are blended with the paper: reddish is enough.
    plain = _pixels(world_sheet(homes)).astype(np.int64)
    noted = _pixels(world_sheet(homes, tasks={homes[0].world_id: []})).astype(np.int64)
    assert np.count_nonzero(plain[..., 0] - plain[..., 2] > 60) == 0
    assert np.count_nonzero(noted[..., 0] - noted[..., 2] > 60) > 50


def _pixels(picture: bytes) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    with Image.open(io.BytesIO(picture)) as image:
        return np.asarray(image.convert("RGB"))
