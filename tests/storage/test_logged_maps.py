import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from ses_core.arrays import BoolArray
from ses_core.errors import NotAMapError, WorldError
from storage.logged_maps import read_logged_map
from storage.world_files import read_map_server
from storage.world_sets import read_worlds
from tests.log_factory import drive, without, write_log

RESOLUTION_M = 0.1
YAW = 0.4


def _values() -> np.ndarray[tuple[int, ...], np.dtype[np.int8]]:
    return np.random.default_rng(5).choice(
        np.array([0, 100, -1], dtype=np.int8), size=(30, 20), p=[0.7, 0.2, 0.1]
    )


def _write_bag(folder: Path, kind: str) -> Path:
    """Write a latched map with rosbags' own writers, an older one before it."""
    is_ros1 = kind == "bag"
    types = get_typestore(Stores.ROS1_NOETIC if is_ros1 else Stores.ROS2_HUMBLE)
    stamp = types.types["builtin_interfaces/msg/Time"](sec=1, nanosec=0)
    name = "nav_msgs/msg/OccupancyGrid"
    make_header = types.types["std_msgs/msg/Header"]
    header = (
        make_header(seq=0, stamp=stamp, frame_id="map")
        if is_ros1
        else make_header(stamp=stamp, frame_id="map")
    )
    position = types.types["geometry_msgs/msg/Point"](x=-2.0, y=3.0, z=0.0)
    turn = types.types["geometry_msgs/msg/Quaternion"](
        x=0.0, y=0.0, z=float(np.sin(YAW / 2)), w=float(np.cos(YAW / 2))
    )
    values = _values()
    messages = [
        types.types[name](
            header=header,
            info=types.types["nav_msgs/msg/MapMetaData"](
                map_load_time=stamp,
                resolution=RESOLUTION_M,
                width=values.shape[1],
                height=values.shape[0],
                origin=types.types["geometry_msgs/msg/Pose"](position=position, orientation=turn),
            ),
            data=data.ravel(),
        )
        for data in (np.zeros_like(values), values)
    ]
    path = folder / (f"log.{kind}" if is_ros1 else "log")
    if is_ros1:
        with Ros1Writer(path) as writer:
            connection = writer.add_connection("/map", name, typestore=types)
            for number, message in enumerate(messages):
                writer.write(connection, number + 1, types.serialize_ros1(message, name))
        return path
    plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
    with Ros2Writer(path, version=9, storage_plugin=plugin) as writer:
        connection = writer.add_connection("/map", name, typestore=types)
        for number, message in enumerate(messages):
            writer.write(connection, number + 1, types.serialize_cdr(message, name))
    return next(path.glob(f"*.{kind}"))


def _cells_of_yaml(folder: Path) -> tuple[BoolArray, tuple[float, float]]:
    """Write the same map as map_server keeps it, and read that."""
    shades = np.select([_values() == 0, _values() == 100], [254, 0], 205).astype(np.uint8)
    Image.fromarray(shades[::-1]).save(folder / "map.pgm")
    (folder / "map.yaml").write_text(
        f"image: map.pgm\nresolution: {RESOLUTION_M}\norigin: [-2.0, 3.0, {YAW}]\n"
    )
    grid = read_map_server(folder / "map.yaml").grid
    return grid.cells, grid.origin


@pytest.mark.parametrize("kind", ["bag", "db3", "mcap"])
def test_a_logged_map_equals_the_same_map_kept_by_map_server(tmp_path: Path, kind: str) -> None:
    cells, origin = _cells_of_yaml(tmp_path)
    (world,) = read_worlds([_write_bag(tmp_path, kind)])
    assert np.array_equal(world.grid.cells, cells)
    assert world.grid.origin == pytest.approx(origin, abs=1e-6)
    assert world.grid.resolution == pytest.approx(RESOLUTION_M)
    assert world.source == "log"


def test_a_log_is_read_under_any_name_and_never_changed(tmp_path: Path) -> None:
    path = tmp_path / "what?mode=rw&x#1.db3"
    shutil.copy(_write_bag(tmp_path, "db3"), path)
    before = path.read_bytes()
    assert read_logged_map(path).grid.cells.any()
    assert path.read_bytes() == before


def test_a_log_without_a_map_says_so_and_a_folder_passes_over_it(tmp_path: Path) -> None:
    log, _ = write_log(tmp_path, "bag", without(drive(2.0), "map"))
    with pytest.raises(NotAMapError, match=r"gives no map: .*OccupancyGrid, expected one"):
        read_logged_map(log)


def test_what_is_no_log_is_refused(tmp_path: Path) -> None:
    (tmp_path / "fake.mcap").write_bytes(b"not a log at all")
    cut = tmp_path / "cut.bag"
    cut.write_bytes(_write_bag(tmp_path, "bag").read_bytes()[:300])
    with pytest.raises(WorldError, match="is no ROS log"):
        read_logged_map(tmp_path / "fake.mcap")
    with pytest.raises(WorldError, match="gives no map"):
        read_logged_map(cut)


def test_a_log_that_may_not_be_read_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.bag").symlink_to(tmp_path / "a.bag")
    with pytest.raises(WorldError, match=r"a\.bag cannot be read"):
        read_logged_map(tmp_path / "a.bag")
