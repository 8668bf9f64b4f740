import numpy as np
import pytest
from scipy import ndimage

from ses_core.robot_profile import JACKAL
from ses_core.worlds.furniture import Piece, furniture_for, stamp
from ses_core.worlds.home_layout import (
    DOOR_WIDTHS_M,
    OPENING_WIDTHS_M,
    RESOLUTION_M,
    Doorway,
    lay_out,
)
from ses_core.worlds.homes import generate_home, generate_homes
from ses_core.worlds.pairs import sample_tasks, standing_places


def test_a_home_does_not_depend_on_how_many_are_generated() -> None:
    homes = generate_homes(3, seed=4)
    assert homes[2].world_id == generate_home(2, seed=4).world_id
    assert len({home.world_id for home in homes}) == 3


@pytest.mark.parametrize("seed", range(20))
def test_every_open_room_of_a_layout_can_be_entered(seed: int) -> None:
    layout = lay_out((12.0, 18.0), rng=np.random.default_rng(seed))
    assert layout.cells[[0, -1]].all()
    assert layout.cells[:, [0, -1]].all()
    regions, count = ndimage.label(~layout.cells)
    assert count == 1
    rooms = [regions[room.bottom : room.top, room.left : room.right] for room in layout.rooms]
    assert all((room == 1).all() for room in rooms)
    for room in layout.rooms:
        assert room.doorways
        for doorway in room.doorways:
            assert DOOR_WIDTHS_M[0] <= _clear_width(doorway) <= OPENING_WIDTHS_M[1]


def _clear_width(doorway: Doorway) -> float:
    """A doorway is longer along its wall than the wall is thick."""
    sides = (part.stop - part.start for part in (doorway.rows, doorway.columns))
    return max(sides) * RESOLUTION_M


@pytest.mark.parametrize("index", range(8))
def test_a_jackal_gets_far_in_a_home_that_is_walled_all_round(index: int) -> None:
    home = generate_home(index, seed=3)
    cells = home.grid.cells
    assert cells[[0, -1]].all()
    assert cells[:, [0, -1]].all()
    places = standing_places(home.grid, JACKAL)
    largest = places.points[places.regions == np.bincount(places.regions).argmax()]
    assert np.linalg.norm(np.ptp(largest, axis=0)) >= 9.0
    assert len(sample_tasks(home, 2, profile=JACKAL, rng=np.random.default_rng(0))) == 2


def test_furniture_never_comes_between_the_doorways_of_a_home() -> None:
    for index in range(4):
        home = generate_home(index, seed=8)
        regions, _ = ndimage.label(~home.grid.cells, structure=np.ones((3, 3)))
        sizes = np.bincount(regions.ravel())[1:]
        # Corners behind furniture may be cut off; a room may not.
        assert sizes.max() >= 0.8 * sizes.sum()


def test_a_ground_of_a_given_size_is_used_and_one_too_small_refused() -> None:
    home = generate_home(0, seed=1, sides_m=(10.0, 24.0))
    assert home.grid.height_m <= 10.0
    assert 12.0 <= home.grid.width_m <= 24.0
    with pytest.raises(ValueError, match=r"home has 3 x 20 m of ground, expected at least 6 x 12"):
        generate_home(0, seed=1, sides_m=(3.0, 20.0))


def test_what_stands_at_a_wall_touches_it() -> None:
    rng = np.random.default_rng(0)
    pieces = [piece for area in (5.0, 10.0, 25.0) for piece in _furniture(area, rng)]
    assert {piece.at_wall for piece in pieces} == {True, False}
    for piece in pieces:
        if piece.at_wall:
            covered = stamp(piece, (100, 120), (3.0, 0.0), 0.0)
            assert covered[0].any()
            rows, columns = np.nonzero(covered)
            assert (rows.max() + 1) * RESOLUTION_M == pytest.approx(piece.depth, abs=0.06)
            assert np.ptp(columns) * RESOLUTION_M <= piece.length + 0.06


def _furniture(area: float, rng: np.random.Generator) -> list[Piece]:
    return furniture_for(area, is_corridor=False, rng=rng)
