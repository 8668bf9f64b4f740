import math
import time
from pathlib import Path

import numpy as np
import pytest

from ses_core.errors import WorldError
from ses_core.occupancy import occupied_at
from ses_core.worlds.cellular_automata import COURSE_GOAL, COURSE_START, barn_course, grow_field
from ses_core.worlds.mesh_slicing import MeshSlicing
from storage.gazebo_worlds import read_gazebo_world
from tests.shared_data import shared_data


def _cylinder(name: str, x: float, y: float, *, radius: float = 0.075) -> str:
    return (
        f"<model name='{name}'><static>1</static><pose frame=''>{x} {y} 0 0 0 0</pose>"
        f"<link name='link'><collision name='c'><geometry><cylinder><radius>{radius}</radius>"
        "<length>1</length></cylinder></geometry></collision></link></model>"
    )


def _box(x: float, y: float, yaw: float, size: str, *, link: str = "0 0 0 0 0 0") -> str:
    return (
        f"<model name='box'><pose>{x} {y} 0 0 0 {yaw}</pose><link name='link'><pose>{link}</pose>"
        f"<collision name='c'><geometry><box><size>{size}</size></box></geometry></collision>"
        "</link></model>"
    )


def _write(folder: Path, *models: str, state: str = "") -> Path:
    path = folder / "place.world"
    path.write_text(
        f"<?xml version='1.0'?><sdf version='1.6'><world name='default'>{''.join(models)}"
        f"<state world_name='default'>{state}</state></world></sdf>"
    )
    return path


def test_a_field_written_as_barn_does_reads_back_cell_for_cell(tmp_path: Path) -> None:
    course = barn_course(grow_field(0.2, 3, rng=np.random.default_rng(1)))
    places = [(-4.5 + 0.15 * (ix + 0.5), 0.15 * (iy + 0.5)) for iy, ix in np.argwhere(course.cells)]
    models = [_cylinder(f"unit_cylinder_{k}", x, y) for k, (x, y) in enumerate(places)]
    world = read_gazebo_world(_write(tmp_path, *models))
    assert np.array_equal(world.grid.cells, course.cells)
    assert world.grid.origin == course.origin
    assert world.course == (COURSE_START, COURSE_GOAL)
    assert world.source == "barn"


def test_models_in_the_state_are_not_read_again(tmp_path: Path) -> None:
    one = _cylinder("a", 0.0, 0.0, radius=0.3)
    alone = read_gazebo_world(_write(tmp_path, one))
    repeated = read_gazebo_world(_write(tmp_path, one, state=_cylinder("a", 9.0, 9.0, radius=0.3)))
    assert np.array_equal(alone.grid.cells, repeated.grid.cells)


def test_turned_boxes_stand_where_model_and_link_put_them(tmp_path: Path) -> None:
    # 2 x 0.2 m, turned by 90 degrees: it reaches along y; its link is 1 m along the turned x.
    path = _write(tmp_path, _box(5.0, 1.0, math.pi / 2, "2 0.2 1", link="1 0 0 0 0 0"))
    grid = read_gazebo_world(path).grid
    points = np.array([(5.0, 2.0), (5.0, 1.1), (5.0, 2.9), (5.3, 2.0), (5.0, 0.8)])
    assert occupied_at(grid, points, outside=False).tolist() == [True, True, True, False, False]


def test_boxes_that_fill_cells_give_just_these_cells(tmp_path: Path) -> None:
    cells = np.random.default_rng(3).random((12, 17)) < 0.3
    cells[[0, -1]] = True
    cells[:, [0, -1]] = True
    size, boxes = 0.3, []
    for iy, ix in np.argwhere(cells):
        x, y = -1.2 + size * (ix + 0.5), 0.6 + size * (iy + 0.5)
        boxes.append(_box(x, y, 0.0, f"{size} {size} 1"))
    grid = read_gazebo_world(_write(tmp_path, *boxes), resolution=size).grid
    assert np.array_equal(grid.cells, cells)
    assert grid.origin == pytest.approx((-1.2, 0.6))


def test_floors_ceilings_and_the_ground_plane_are_in_nobodys_way(tmp_path: Path) -> None:
    floor = _box(0, 0, 0, "9 9 0.1").replace("<pose>0 0 0 0", "<pose>0 0 -0.05 0")
    lamp = _box(1, 1, 0, "1 1 0.2").replace("<pose>1 1 0 0", "<pose>1 1 2.2 0")
    plane = (
        "<model name='ground_plane'><link name='l'><collision name='c'><geometry><plane>"
        "<size>9 9</size></plane></geometry></collision></link></model>"
        "<include><uri>model://sun</uri></include>"
    )
    post = _box(2, 2, 0, "0.5 0.5 1")
    grid = read_gazebo_world(_write(tmp_path, floor, lamp, plane, post)).grid
    assert grid.cells.shape == (10, 10)
    assert grid.cells.all()
    alone = _write(tmp_path, floor, lamp, post)
    assert read_gazebo_world(alone, slicing=MeshSlicing(low=0.1, high=3.0)).grid.width_m > 1.5


def test_spheres_and_nested_models_are_solids_too(tmp_path: Path) -> None:
    sphere = _cylinder("ball", 1.0, 0.0, radius=0.5).replace("cylinder>", "sphere>")
    nested = f"<model name='outer'><pose>0 3 0 0 0 0</pose>{sphere}</model>"
    grid = read_gazebo_world(_write(tmp_path, nested)).grid
    assert grid.origin == pytest.approx((0.5, 2.5))
    assert occupied_at(grid, np.array([(1.0, 3.0)]), outside=False).all()


@pytest.mark.parametrize(
    ("models", "said"),
    [
        ("<include><uri>model://table</uri></include>", "includes model://table, expected every"),
        (_box(0, 0, 0, "1 1 1").replace("box>", "mesh>"), "has a mesh in model 'box', expected"),
        (_box(0, 0, 0, "1 1 1").replace("0 0 0 0 0 0", "0 0 0 0.5 0 0", 1), "tilted by 0.5"),
        (_box(0, 0, 0, "1 0 1"), "without size"),
        (_cylinder("a", 0, 0, radius=-1.0), "without size"),
    ],
)
def test_what_cannot_be_seen_from_above_is_refused(tmp_path: Path, models: str, said: str) -> None:
    with pytest.raises(WorldError, match=said):
        read_gazebo_world(_write(tmp_path, models))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<sdf><world>", "is no XML"),
        ("<sdf></sdf>", "has no <world>"),
        ("<sdf><world name='a'></world></sdf>", "no cylinder or box"),
        (
            "<!DOCTYPE x [<!ENTITY a 'aaaa'><!ENTITY b '&a;&a;'>]><sdf><world>&b;</world></sdf>",
            "document type",
        ),
        (
            "<sdf><world name='a'>"
            + _cylinder("a", 0, 0).replace("0.075", "wide")
            + "</world></sdf>",
            "expected 1 numbers",
        ),
        (
            "<sdf><world name='a'>"
            + _cylinder("a", 0, 0).replace("0 0 0 0 0 0", "nan 0 0 0 0 0")
            + "</world></sdf>",
            "expected 6 numbers",
        ),
        (
            "<sdf><world name='a'>"
            + _cylinder("a", 0, 0)
            + _cylinder("b", 1e7, 1e7)
            + "</world></sdf>",
            "expected at most",
        ),
    ],
)
def test_a_bad_world_is_refused_with_its_reason(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bad.world"
    path.write_text(text)
    with pytest.raises(WorldError, match=said):
        read_gazebo_world(path)


def test_an_original_barn_world_has_its_cylinders_and_course() -> None:
    world = read_gazebo_world(shared_data("barn", "world_0.world"))
    assert world.grid.cells.shape == (94, 30)
    assert np.count_nonzero(world.grid.cells) == 209
    assert world.course == (COURSE_START, COURSE_GOAL)


def test_comments_and_empty_elements_hide_no_obstacle(tmp_path: Path) -> None:
    posts = (_box(0, 0, 0, "1 1 1"), _box(3, 0, 0, "1 1 1"), _box(6, 0, 0, "1 1 1"))
    alone = read_gazebo_world(_write(tmp_path, *posts))
    commented = ("<!-- a <state> of mind -->", posts[0], "<state/>", posts[1])
    read = read_gazebo_world(_write(tmp_path, *commented, "<!-- </state><visual> -->", posts[2]))
    assert np.array_equal(alone.grid.cells, read.grid.cells)
    nested = f"<state><model><state>{posts[2]}</state>{posts[2]}</model>{posts[2]}</state>"
    read = read_gazebo_world(_write(tmp_path, *posts[:2], nested))
    assert read.grid.width_m == pytest.approx(4.0)


def test_a_file_crafted_to_be_slow_is_read_in_a_moment(tmp_path: Path) -> None:
    path = _write(tmp_path, _box(0, 0, 0, "1 1 1") + "<!-- " + "<state>" * 300_000 + " -->")
    started = time.process_time()
    read_gazebo_world(path)
    assert time.process_time() - started < 5.0


def test_models_nested_too_deep_are_refused_in_one_line(tmp_path: Path) -> None:
    deep = "<model>" * 100_000 + "</model>" * 100_000
    with pytest.raises(WorldError, match="nests elements more than 64 deep"):
        read_gazebo_world(_write(tmp_path, deep))


@pytest.mark.parametrize("name", ["floor_10x10", "ses_floor_10x10"])
def test_a_strangers_floor_is_no_mark_of_ours(tmp_path: Path, name: str) -> None:
    posts = _box(0, 0, 0, "1 1 1"), _box(20, 0, 0, "1 1 1")
    box = "<geometry><box><size>10 10 0.01</size></box></geometry>"
    floor = (
        f'<model name="{name}"><link name="l"><visual name="v">{box}</visual>'
        f'<collision name="c">{box}</collision></link></model>'
    )
    marks = _box(5, 5, 0, "1 1 1"), _box(8, 8, 0, "1 1 1")
    named = [
        mark.replace("'box'", f"'{model}'")
        for mark, model in zip(marks, ("start", "goal"), strict=True)
    ]
    for text in (floor, floor.replace(f'<collision name="c">{box}</collision>', "")):
        if name.startswith("ses") and "collision" not in text:
            continue
        world = read_gazebo_world(_write(tmp_path, *posts, text, *named))
        assert world.grid.width_m == pytest.approx(21.0)
        assert world.course is None
