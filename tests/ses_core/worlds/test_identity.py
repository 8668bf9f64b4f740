from dataclasses import replace

import numpy as np

from ses_core.geometry import Pose2D
from ses_core.occupancy import OccupancyGrid
from ses_core.worlds.identity import content_digest, named_world, world_digest

GRID = OccupancyGrid(cells=np.eye(4, dtype=np.bool_), resolution=0.1)


def test_equal_content_keeps_its_digits_under_another_name() -> None:
    first = named_world("a", GRID, source="test")
    second = named_world("b", replace(GRID, cells=GRID.cells.copy()), source="test")
    assert first.world_id.removeprefix("a-") == second.world_id.removeprefix("b-")


def test_cells_shape_resolution_and_origin_all_count() -> None:
    others = [
        replace(GRID, cells=~GRID.cells),
        replace(GRID, cells=GRID.cells.reshape(2, 8)),
        replace(GRID, resolution=0.2),
        replace(GRID, origin=(0.0, 1.0)),
    ]
    assert len({content_digest(grid) for grid in (GRID, *others)}) == 5


def test_a_course_is_part_of_what_a_world_is() -> None:
    start, goal = Pose2D(0.0, 0.0, 0.5), (1.0, 2.0)
    courses = [
        (start, goal),
        (replace(start, x=0.1), goal),
        (replace(start, y=0.1), goal),
        (replace(start, yaw=0.1), goal),
        (start, (1.1, 2.0)),
        (start, (1.0, 2.1)),
        None,
    ]
    worlds = [named_world("a", GRID, source="test", course=course) for course in courses]
    assert len({world.world_id for world in worlds}) == len(courses)
    assert world_digest(GRID, None) == content_digest(GRID)
    # Whole numbers and numpy's are the same course.
    same = (Pose2D(0, 0, np.float64(0.5)), (1, np.float64(2.0)))
    assert world_digest(GRID, same) == world_digest(GRID, courses[0])
