import numpy as np
import pytest
from scipy import ndimage

from ses_core.robot_profile import JACKAL
from ses_core.worlds.homes import generate_home, generate_homes
from ses_core.worlds.pairs import sample_tasks


def test_a_home_does_not_depend_on_how_many_are_generated() -> None:
    homes = generate_homes(3, seed=4)
    assert homes[2].world_id == generate_home(2, seed=4).world_id
    assert len({home.world_id for home in homes}) == 3


@pytest.mark.parametrize("index", range(8))
def test_a_jackal_gets_from_anywhere_to_anywhere(index: int) -> None:
    home = generate_home(index, seed=0)
    clearance = ndimage.distance_transform_edt(~home.grid.cells) * home.grid.resolution
    regions, _ = ndimage.label(clearance > JACKAL.inscribed_radius_m)
    sizes = np.bincount(regions[clearance > JACKAL.circumscribed_radius_m])
    # A corner behind furniture may be cut off; a room may not.
    assert sizes.max() >= 0.97 * sizes.sum()


@pytest.mark.parametrize("index", range(8))
def test_a_home_is_walled_all_round_and_long_enough_for_pairs(index: int) -> None:
    home = generate_home(index, seed=3)
    cells = home.grid.cells
    assert cells[[0, -1]].all()
    assert cells[:, [0, -1]].all()
    assert len(sample_tasks(home, 2, profile=JACKAL, rng=np.random.default_rng(0))) == 2


def test_homes_have_rooms_doors_and_furniture() -> None:
    for home in generate_homes(4, seed=8):
        free = ~home.grid.cells
        # Closing every gap narrower than 1.4 m takes corridors and doors away: rooms are left.
        wide = ndimage.distance_transform_edt(free) * home.grid.resolution > 1.0
        _, rooms = ndimage.label(wide)
        assert rooms >= 2
        _, pieces = ndimage.label(home.grid.cells)
        assert pieces >= 3
