import tarfile
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import trimesh
from PIL import Image

from ses_core.errors import WorldError
from ses_core.navigation import World
from ses_core.worlds import grids
from ses_core.worlds.cellular_automata import generate_barn
from ses_core.worlds.homes import generate_homes
from storage import world_tables
from storage.world_sets import find_worlds, read_worlds, write_world_set
from storage.world_sources import Reading
from tests.shared_data import shared_data


def _worlds() -> list[World]:
    return [
        *(generated.world for generated in generate_barn(2, seed=0)),
        *generate_homes(2, seed=0),
    ]


def _draw(path: Path, *, free: int = 3) -> None:
    light = np.zeros((6, 6), dtype=np.uint8)
    light[1 : 1 + free, 1:5] = 255
    Image.fromarray(light).save(path)


def test_a_world_set_reads_back_equal(tmp_path: Path) -> None:
    worlds = _worlds()
    write_world_set(tmp_path / "set", worlds)
    for written, read in zip(worlds, read_worlds([tmp_path / "set"]), strict=True):
        assert np.array_equal(written.grid.cells, read.grid.cells)
        assert written.grid.origin == read.grid.origin
        assert (written.world_id, written.name, written.source, written.course) == (
            read.world_id,
            read.name,
            read.source,
            read.course,
        )
    assert (tmp_path / "set" / "preview.png").stat().st_size > 1000


def test_a_world_set_is_a_table_for_pandas(tmp_path: Path) -> None:
    worlds = _worlds()
    write_world_set(tmp_path, worlds)
    table = pd.read_parquet(tmp_path / "worlds.parquet")
    assert table["world_id"].tolist() == [world.world_id for world in worlds]
    assert table["free_fraction"].tolist() == pytest.approx(
        [np.mean(~world.grid.cells) for world in worlds]
    )
    assert table["goal_y_m"].isna().tolist() == [False, False, True, True]


def test_folders_of_images_are_read_by_number_and_the_rest_is_passed_over(tmp_path: Path) -> None:
    for number in (10, 2, 1):
        _draw(tmp_path / f"model{number}.png", free=1 + number % 3)
    (tmp_path / "README.md").write_text("about")
    (tmp_path / "index.csv").write_text("a,b\n")
    found = find_worlds([tmp_path], reading=Reading(resolution=0.1))
    assert [world.name for world in found.worlds] == ["model1", "model2", "model10"]
    assert [path.name for path in found.passed_over] == ["README.md", "index.csv"]


def test_a_split_file_chooses_a_part(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        _draw(tmp_path / f"{name}.png", free=1 + ord(name) % 3)
    (tmp_path / "split.csv").write_text("house,part\na,fit\nb,test\nc,fit\n")
    assert [world.name for world in read_worlds([tmp_path], part="fit", resolution=0.1)] == [
        "a",
        "c",
    ]
    with pytest.raises(WorldError, match="no part 'train', expected one of fit, test"):
        read_worlds([tmp_path], part="train", resolution=0.1)
    (tmp_path / "split.csv").unlink()
    with pytest.raises(WorldError, match=r"no split\.csv"):
        read_worlds([tmp_path], part="fit", resolution=0.1)


def test_a_maps_own_image_is_not_read_twice(tmp_path: Path) -> None:
    _draw(tmp_path / "floor.png")
    (tmp_path / "floor.yaml").write_text("image: floor.png\nresolution: 0.2\norigin: [0, 0, 0]\n")
    worlds = read_worlds([tmp_path])
    assert [(world.name, world.grid.resolution) for world in worlds] == [("floor", 0.2)]


def test_the_same_world_found_twice_counts_once(tmp_path: Path) -> None:
    _draw(tmp_path / "a.png")
    assert len(read_worlds([tmp_path, tmp_path / "a.png"], resolution=0.1)) == 1


def test_what_cannot_be_read_says_why(tmp_path: Path) -> None:
    _draw(tmp_path / "a.png")
    (tmp_path / "notes.txt").write_text("no map")
    (tmp_path / "worlds.parquet").write_bytes(b"PAR1 not really")
    empty = tmp_path / "empty"
    empty.mkdir()
    for path, said in (
        (tmp_path / "a.png", "--resolution"),
        (tmp_path / "notes.txt", "is no map"),
        (tmp_path / "gone", "is missing"),
        (empty, "no world in"),
        (tmp_path / "worlds.parquet", "cannot be read as a world set"),
    ):
        with pytest.raises(WorldError, match=said):
            read_worlds([path])


def test_a_damaged_page_of_a_world_set_is_found(tmp_path: Path) -> None:
    write_world_set(tmp_path, _worlds())
    file = tmp_path / "worlds.parquet"
    content = bytearray(file.read_bytes())
    content[200] ^= 0xFF
    file.write_bytes(content)
    with pytest.raises(WorldError, match="cannot be read"):
        read_worlds([tmp_path])


def test_equal_ids_and_empty_sets_are_refused(tmp_path: Path) -> None:
    worlds = generate_homes(1, seed=0)
    with pytest.raises(WorldError, match="is there twice"):
        write_world_set(tmp_path, worlds * 2)
    with pytest.raises(WorldError, match="no world to write"):
        write_world_set(tmp_path, [])


@pytest.mark.parametrize(
    ("folder", "resolution", "part", "count"),
    [
        ("maps", 0.05, None, 5),
        ("houses", 0.01, None, 59),
        ("matterport", 0.03, "deployment", 40),
        ("matterport", 0.03, "tuning", 10),
        ("barn", None, None, 3),
    ],
)
def test_real_maps_of_every_kind_are_read(
    folder: str, resolution: float | None, part: str | None, count: int
) -> None:
    worlds = read_worlds([shared_data(folder)], part=part, resolution=resolution)
    assert len(worlds) == count
    assert all(np.mean(~world.grid.cells) > 0.0 for world in worlds)
    assert all(world.grid.width_m < 80.0 for world in worlds)


def test_arrays_clouds_and_lines_are_passed_over_in_a_folder(tmp_path: Path) -> None:
    _draw(tmp_path / "a.png")
    np.savez(tmp_path / "arrays.npz", weights=np.zeros(3))
    trimesh.PointCloud(np.eye(3)).export(tmp_path / "cloud.ply")
    (tmp_path / "line.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    found = find_worlds([tmp_path], reading=Reading(resolution=0.1))
    assert found.refused == ()
    assert [path.name for path in found.passed_over] == ["arrays.npz", "cloud.ply", "line.obj"]
    assert len(read_worlds([tmp_path], resolution=0.1)) == 1


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"resolution_m": float("nan")}, "expected more than 0 m"),
        ({"resolution_m": 0.0}, "expected more than 0 m"),
        ({"origin_x_m": float("inf")}, "two numbers"),
        ({"goal_y_m": None}, "expected five numbers or none"),
        ({"start_x_m": None}, "expected five numbers or none"),
        ({"height_cells": 10**6, "width_cells": 10**6, "cells": b"a"}, "expected at most"),
        ({"height_cells": -1, "width_cells": -8, "cells": b"a"}, "bytes of cells in"),
        ({"world_id": "a" * (1 << 20)}, "unpacks to more than"),
    ],
)
def test_a_world_set_that_cannot_be_is_refused(
    tmp_path: Path, changed: dict[str, object], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_world_set(tmp_path, _worlds()[:1])
    table = pq.read_table(tmp_path / "worlds.parquet")
    rows = [{**row, **changed} for row in table.to_pylist()] * 20
    pq.write_table(pa.Table.from_pylist(rows, schema=table.schema), tmp_path / "worlds.parquet")
    monkeypatch.setattr(world_tables, "_MOST_BYTES", 4 << 20)
    with pytest.raises(WorldError, match=said):
        read_worlds([tmp_path])


@pytest.mark.parametrize("kind", ["folder", "archive", "set"])
def test_more_cells_than_fit_into_memory_are_refused(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in range(3):
        np.save(tmp_path / f"grid_{number}.npy", np.eye(30, k=number))
    path = tmp_path
    if kind == "archive":
        path = tmp_path / "a.tar"
        with tarfile.open(path, "w") as archive:
            for file in sorted(tmp_path.glob("*.npy")):
                archive.add(file)
    elif kind == "set":
        path = tmp_path / "set"
        write_world_set(path, read_worlds([tmp_path]))
    monkeypatch.setattr(grids, "_MOST_TOGETHER", 94 * 30 * 2)
    with pytest.raises(WorldError, match="these worlds have more than 5640 cells together"):
        find_worlds([path])


def test_a_yaml_hides_the_picture_it_names_and_no_other(tmp_path: Path) -> None:
    for free, name in enumerate(("floor", "scan", "plan"), start=1):
        _draw(tmp_path / f"{name}.png", free=free)
    keys = "resolution: 0.2\norigin: [0, 0, 0]\n"
    (tmp_path / "floor.yaml").write_text(f"image: ../{tmp_path.name}/./scan.png\n{keys}")
    (tmp_path / "plan.yaml").write_text("title: no map\n")
    found = find_worlds([tmp_path], reading=Reading(resolution=0.1))
    assert [(world.name, world.source) for world in found.worlds] == [
        ("floor", "image"),
        ("floor", "map_server"),
        ("plan", "image"),
    ]
    assert [path.name for path in found.passed_over] == ["plan.yaml"]
