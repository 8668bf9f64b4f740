import tarfile
from pathlib import Path

import numpy as np
from scipy import ndimage

from ses_core.worlds.barn_path import search_path
from ses_core.worlds.cellular_automata import FIELD_CELLS, barn_course
from storage.world_sets import read_worlds
from tests.shared_data import shared_data

FIRST_ROW = 34  # of the field in a course, behind its corridor


def test_barns_own_fields_give_barns_own_paths(tmp_path: Path) -> None:
    numbers = range(0, 300, 25)
    with tarfile.open(shared_data("barn", "BARN_300_worlds_and_paths.tar.xz")) as archive:
        archive.extractall(tmp_path, filter="data")
    for number in numbers:
        [world] = read_worlds([tmp_path / "BARN" / f"world_{number}.world"])
        field = world.grid.cells[FIRST_ROW : FIRST_ROW + FIELD_CELLS].T
        # Corridor, field and open ground stand where our own courses have them.
        assert np.array_equal(world.grid.cells, barn_course(field).cells)
        # The published path names its start twice.
        published = np.load(tmp_path / "BARN" / "path_files" / f"path_{number}.npy")[1:]
        blocked = ndimage.binary_dilation(field, structure=np.ones((5, 5), dtype=np.bool_))
        start, goal = (tuple(int(cell) for cell in end) for end in (published[0], published[-1]))
        found = search_path(blocked, (start[0], start[1]), (goal[0], goal[1]))
        assert found is not None
        assert np.array_equal(found, published)


def test_a_path_turns_by_at_most_45_degrees_per_cell() -> None:
    blocked = np.ones((30, 30), dtype=np.bool_)
    blocked[5, :10] = blocked[7, :10] = False
    # One cell joins the two lanes: whoever turns back in it turns by 90 degrees at once.
    blocked[6, 10] = False
    assert search_path(blocked, (5, 0), (7, 0)) is None
    # Straight on it can change lanes, one diagonal step after the other.
    blocked[5, 10:13] = blocked[6, 10:13] = blocked[7, 12:] = False
    path = search_path(blocked, (5, 0), (7, 29))
    assert path is not None
    assert path[0].tolist() == [5, 0]
    assert path[-1].tolist() == [7, 29]


def test_a_path_never_squeezes_between_two_blocked_corners() -> None:
    blocked = np.zeros((5, 5), dtype=np.bool_)
    blocked[2] = True
    blocked[2, 2] = blocked[3, 2] = False
    blocked[3, 1] = True
    path = search_path(blocked, (0, 2), (4, 2))
    assert path is not None
    assert [2, 2] in path.tolist()
    blocked[1:4] = [[0, 1, 0, 1, 1], [1, 0, 1, 1, 1], [0, 1, 1, 1, 1]]
    # Only the diagonals through (2, 1) are left.
    assert search_path(blocked, (0, 2), (4, 0)) is None
