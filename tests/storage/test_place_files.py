"""Places written for other tools, and read back by our own readers."""

import json
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pybullet
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from ses_core.arrays import BoolArray
from ses_core.errors import WorldError
from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationEnvironment, World
from ses_core.occupancy import OccupancyGrid, cell_centres, occupied_at
from ses_core.place import (
    Place,
    course_of_environment,
    place_of_environment,
    place_of_world,
)
from ses_core.worlds.cellular_automata import generate_barn
from ses_core.worlds.homes import generate_homes
from storage.array_worlds import read_array_world
from storage.gazebo_worlds import read_gazebo_world
from storage.place_files import PlaceFormat, place_pixels, write_place
from storage.world_files import read_image, read_map_server
from storage.world_sets import read_worlds

NAMES: dict[PlaceFormat, str] = {
    "sdf": "place.world",
    "map-server": "place.yaml",
    "png": "place.png",
    "npz": "place.npz",
}


def environment(cells: BoolArray, observed: BoolArray | None = None) -> NavigationEnvironment:
    return NavigationEnvironment(
        environment_id="0f3c9a51d2b7e864",
        cells=cells,
        observed=np.ones_like(cells) if observed is None else observed,
        origin="scan",
    )


def noise(seed: int, share: float = 0.3) -> BoolArray:
    return np.random.default_rng(seed).random((30, 30)) < share


SQUARES = st.builds(
    noise,
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 0.01, 0.3, 0.7, 0.99, 1.0]),
)
"""Any 30 x 30 cells, empty and full ones among them."""


def read_back(folder: Path, format: PlaceFormat, *, resolution: float) -> World:  # noqa: A002
    (world,) = read_worlds([folder / NAMES[format]], resolution=resolution)
    return world


def says_the_same(world: World, place: Place, blocked: BoolArray, shift: Pose2D) -> bool:
    """Ask the world at each of the place's cells; a map is cut down to what is free."""
    rows, columns = np.indices(blocked.shape)
    centres = cell_centres(place.grid, np.column_stack((columns.ravel(), rows.ravel())))
    asked = occupied_at(world.grid, centres - (shift.x, shift.y)).reshape(blocked.shape)
    return bool(np.array_equal(asked, blocked))


@settings(max_examples=40, deadline=None)
@given(cells=SQUARES)
def test_any_environment_comes_back_from_gazebo_cell_for_cell(
    cells: BoolArray, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("sdf")
    place = place_of_environment(environment(cells))
    write_place(folder / NAMES["sdf"], place, format="sdf")
    world = read_gazebo_world(folder / NAMES["sdf"])
    assert np.array_equal(world.grid.cells, place.grid.cells)
    assert world.grid.resolution == pytest.approx(place.grid.resolution, rel=1e-12)
    assert world.grid.origin == place.grid.origin
    assert world.course == (Pose2D(0.0, 0.0), (5.0, 0.0))


@settings(max_examples=40, deadline=None)
@given(cells=SQUARES, observed=SQUARES)
def test_any_environment_comes_back_from_map_server(
    cells: BoolArray, observed: BoolArray, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("map")
    place = place_of_environment(environment(cells, observed))
    write_place(folder / NAMES["map-server"], place, format="map-server")
    blocked = place.grid.cells | ~place.observed
    if blocked.all():
        with pytest.raises(WorldError, match="no cell is free"):
            read_map_server(folder / NAMES["map-server"])
        return
    world = read_map_server(folder / NAMES["map-server"])
    # What a map does not know is no ground to drive on.
    assert says_the_same(world, place, blocked, Pose2D(0.0, 0.0))


@pytest.mark.parametrize("format", list(NAMES))
@pytest.mark.parametrize("kind", ["environment", "course", "barn", "home"])
def test_every_format_gives_the_cells_back(
    format: PlaceFormat,  # noqa: A002
    kind: str,
    tmp_path: Path,
) -> None:
    if kind in ("environment", "course"):
        make = place_of_environment if kind == "environment" else course_of_environment
        place = make(environment(noise(5)))
    else:
        homes = generate_homes(1, seed=2)
        world = homes[0] if kind == "home" else generate_barn(1, seed=1)[0].world
        place = place_of_world(world)
    write_place(tmp_path / NAMES[format], place, format=format)
    found = read_back(tmp_path, format, resolution=place.grid.resolution)
    # An image alone carries no origin.
    origin = place.grid.origin if format == "png" else (0.0, 0.0)
    assert says_the_same(found, place, place.grid.cells, Pose2D(*origin))
    if format in ("sdf", "npz"):
        assert np.array_equal(found.grid.cells, place.grid.cells)
        assert found.grid.origin == place.grid.origin
        assert (found.course is None) == (place.start is None)
        if found.course is not None:
            assert found.course == (place.start, place.goal)


def test_pictures_tell_free_occupied_and_unknown_apart(tmp_path: Path) -> None:
    cells, observed = noise(1), noise(2, 0.7)
    place = place_of_environment(environment(cells, observed))
    write_place(tmp_path / "a.png", place, format="png")
    write_place(tmp_path / "a.yaml", place, format="map-server")
    for file in ("a.png", "a.pgm"):
        with Image.open(tmp_path / file) as image:
            pixels = np.asarray(image)
            assert image.mode == "L"
        # The goal edge of an environment lies to the right, its left edge on top.
        turned = np.rot90(cells, -1)
        assert np.array_equal(pixels == 0, turned)
        assert np.array_equal(pixels == 205, np.rot90(~observed & ~cells, -1))
        assert np.array_equal(pixels == 254, np.rot90(observed & ~cells, -1))
        assert np.array_equal(pixels, place_pixels(place))
    with Image.open(tmp_path / "a.png") as image:
        about = json.loads(image.info["Description"])
    assert about["resolution_m"] == place.grid.resolution
    assert about["origin_m"] == [0.0, -2.5]
    assert about["goal_m"] == [5.0, 0.0]


def test_arrays_say_what_was_observed_and_hold_no_pickle(tmp_path: Path) -> None:
    place = place_of_environment(environment(noise(1), noise(2)))
    write_place(tmp_path / "a.npz", place, format="npz")
    with np.load(tmp_path / "a.npz", allow_pickle=False) as content:
        assert np.array_equal(content["observed"], place.observed)
        assert content["start"].tolist() == [0.0, 0.0, 0.0]
        assert content["goal"].tolist() == [5.0, 0.0]
        assert str(content["identity"]) == place.identity
    first = (tmp_path / "a.npz").read_bytes()
    write_place(tmp_path / "a.npz", place, format="npz")
    assert (tmp_path / "a.npz").read_bytes() == first


def test_a_gazebo_world_needs_nothing_but_itself_and_few_boxes(tmp_path: Path) -> None:
    cells = np.zeros((30, 30), dtype=np.bool_)
    cells[:, 0] = cells[:, -1] = True
    cells[10:12, 4:20] = True
    place = place_of_environment(environment(cells))
    write_place(tmp_path / "a.sdf", place, format="sdf")
    sdf = ET.parse(tmp_path / "a.sdf").getroot()
    assert sdf.get("version") == "1.6"
    assert not list(sdf.iter("include"))
    assert not list(sdf.iter("uri"))
    models = {model.get("name"): model for model in sdf.findall("world/model")}
    assert set(models) == {"ground_plane", "walls", "ses_floor_30x30", "ses_start", "ses_goal"}
    assert all(model.findtext("static") == "1" for model in models.values())
    assert len(models["walls"].findall("link/collision")) == 3
    assert len(models["walls"].findall("link/visual")) == 3
    for mark in ("ses_floor_30x30", "ses_start", "ses_goal"):
        assert not list(models[mark].iter("collision"))


def test_another_reader_of_gazebo_worlds_meets_the_same_walls(tmp_path: Path) -> None:
    place = place_of_environment(environment(noise(1)))
    write_place(tmp_path / "a.sdf", place, format="sdf")
    rows, columns = np.indices(place.grid.cells.shape)
    centres = cell_centres(place.grid, np.column_stack((columns.ravel(), rows.ravel())))
    above, below = (np.insert(centres, 2, z, axis=1).tolist() for z in (2.0, -0.5))
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.loadSDF(str(tmp_path / "a.sdf"), physicsClientId=client)
        pybullet.performCollisionDetection(physicsClientId=client)
        met = pybullet.rayTestBatch(above, below, physicsClientId=client)
    finally:
        pybullet.disconnect(client)
    is_wall = np.array([height > 0.5 for _, _, _, (_, _, height), _ in met])
    assert np.array_equal(is_wall.reshape(place.grid.cells.shape), place.grid.cells)


def test_a_hostile_name_stays_text(tmp_path: Path) -> None:
    name = "a\"></world><!-- 'x' é"
    grid = OccupancyGrid(cells=np.eye(4, dtype=np.bool_), resolution=0.1, origin=(-0.3, 7.1))
    place = Place(identity=name, grid=grid, observed=np.ones((4, 4), dtype=np.bool_))
    write_place(tmp_path / "a.world", place, format="sdf")
    world = ET.parse(tmp_path / "a.world").getroot().find("world")
    assert world is not None
    assert set(str(world.get("name"))) <= set("a_worldx")
    found = read_gazebo_world(tmp_path / "a.world")
    assert np.array_equal(found.grid.cells, grid.cells)
    assert found.course is None


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("ses_floor_30x30", "ses_floor_0x30", "expected 1 to"),
        ("ses_floor_30x30", "ses_floor_99999x99999", "expected 1 to"),
        ("ses_floor_30x30", "ses_floor_30x20", "expected square cells"),
        ("<size>5.0 5.0 0.002", "<size>5.0 wide 0.002", "expected 3 numbers"),
        ("<size>5.0 5.0 0.002", "<size>-5.0 -5.0 0.002", "expected square cells"),
    ],
)
def test_a_floor_that_cannot_be_is_refused(old: str, new: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "a.world"
    write_place(path, place_of_environment(environment(noise(3))), format="sdf")
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(WorldError, match=said):
        read_gazebo_world(path)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"cells": np.zeros((3, 3))}, "expected truth values"),
        ({"cells": np.zeros(3, dtype=np.bool_)}, "expected truth values"),
        ({"resolution": np.float64(-1.0)}, "expected more than 0 m"),
        ({"origin": np.zeros(3)}, "has origin of shape"),
        ({"origin": np.array([np.nan, 0.0])}, "expected more than 0 m"),
        ({"goal": None}, "has no goal, expected the arrays"),
        ({"cells": np.array([[object()]])}, "cannot be read as a world"),
    ],
)
def test_arrays_that_are_no_world_are_refused(
    changed: dict[str, np.ndarray | None], said: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.npz"
    write_place(path, place_of_environment(environment(noise(3))), format="npz")
    with np.load(path) as content:
        fields = {**content, **changed}
    np.savez(path, **{name: value for name, value in fields.items() if value is not None})
    with pytest.raises(WorldError, match=said):
        read_array_world(path)


def test_a_file_that_is_no_archive_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(b"PK\x03\x04nothing")
    with pytest.raises(WorldError, match="cannot be read as a world"):
        read_array_world(tmp_path / "a.npz")


def test_an_image_is_read_where_it_is_light(tmp_path: Path) -> None:
    place = place_of_environment(environment(noise(4), noise(6)))
    write_place(tmp_path / "a.png", place, format="png")
    world = read_image(tmp_path / "a.png", resolution=place.grid.resolution)
    blocked = place.grid.cells | ~place.observed
    assert says_the_same(world, place, blocked, Pose2D(0.0, -2.5))


@pytest.mark.parametrize("field", [6, 8])
def test_an_archive_of_arrays_that_is_locked_is_refused(field: int, tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    write_place(path, place_of_environment(environment(noise(3))), format="npz")
    content = bytearray(path.read_bytes())
    # The flag of encryption, or a method of compression that nobody has, in every entry.
    for start, shift in ((b"PK\x03\x04", 0), (b"PK\x01\x02", 2)):
        found = content.find(start)
        while found >= 0:
            content[found + field + shift] |= 1 if field == 6 else 0x60
            found = content.find(start, found + 4)
    path.write_bytes(content)
    with pytest.raises(WorldError, match=r"a\.npz cannot be read as a world"):
        read_array_world(path)
