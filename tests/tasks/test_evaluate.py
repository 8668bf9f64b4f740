"""What decides that a night's held-out worlds are others."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from ses_core.geometry import Pose2D
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.identity import named_world
from storage.world_sets import write_world_set
from tasks.evaluate import HeldoutWorlds, heldout_digest


def test_a_night_on_other_courses_of_the_same_maps_is_another(tmp_path: Path) -> None:
    grid = OccupancyGrid(cells=np.zeros((40, 40), dtype=np.bool_), resolution=0.1)
    start = Pose2D(1.0, 1.0)
    world = named_world("hall", grid, source="test", course=(start, (3.0, 3.0)))
    digests = set()
    for number, course in enumerate(((start, (3.0, 3.0)), (start, (3.0, 2.0)), None)):
        # Under one id, as in sets whose ids say nothing of the course.
        write_world_set(tmp_path / str(number), [replace(world, course=course)])
        digests.add(heldout_digest(HeldoutWorlds(paths=(tmp_path / str(number),))))
    assert len(digests) == 3
