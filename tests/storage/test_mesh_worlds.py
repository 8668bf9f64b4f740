from pathlib import Path

import numpy as np
import pytest
import trimesh

from ses_core.errors import WorldError
from ses_core.occupancy import draw
from ses_core.worlds.mesh_slicing import MeshSlicing
from storage import mesh_worlds
from storage.decoder_child import decode_request
from storage.mesh_triangles import decode_triangles
from storage.mesh_worlds import read_mesh
from storage.quarantine import REASONS
from tests.rooms import FURNISHED_ROOM, ROOM_DRAWN, room

CELL_M = 0.25


def _mesh(*boxes: np.ndarray[tuple[int, ...], np.dtype[np.float32]]) -> trimesh.Trimesh:
    triangles = np.concatenate(boxes) if boxes else FURNISHED_ROOM
    return trimesh.Trimesh(
        vertices=triangles.reshape(-1, 3), faces=np.arange(3 * len(triangles)).reshape(-1, 3)
    )


def _y_up(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    turn = trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0))
    return mesh.copy().apply_transform(turn)


@pytest.mark.parametrize("suffix", ["glb", "ply", "obj", "stl"])
def test_a_room_in_every_format_slices_to_its_cells(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"room.{suffix}"
    mesh = _y_up(_mesh()) if suffix == "glb" else _mesh()
    mesh.export(path)
    world = read_mesh(path, slicing=MeshSlicing(), resolution=CELL_M)
    assert draw(world.grid.cells[::-1]).splitlines() == ROOM_DRAWN.split()
    assert (world.name, world.source) == ("room", "mesh")


def test_parts_of_a_scene_stand_where_it_puts_them(tmp_path: Path) -> None:
    parts = room()
    scene = trimesh.Scene()
    for part in parts:
        mesh = _mesh(part)
        offset = mesh.bounds[0]
        mesh.apply_translation(-offset)
        scene.add_geometry(mesh, transform=trimesh.transformations.translation_matrix(offset))
    scene.export(tmp_path / "room.glb")
    world = read_mesh(tmp_path / "room.glb", slicing=MeshSlicing(up="z"), resolution=CELL_M)
    assert draw(world.grid.cells[::-1]).splitlines() == ROOM_DRAWN.split()


def test_what_is_no_mesh_is_refused_with_its_reason(tmp_path: Path) -> None:
    good = tmp_path / "room.ply"
    _mesh().export(good)
    (tmp_path / "cut.ply").write_bytes(good.read_bytes()[: good.stat().st_size // 2])
    (tmp_path / "noise.glb").write_bytes(b"glTF" + bytes(range(200)))
    (tmp_path / "empty.stl").write_bytes(b"")
    trimesh.PointCloud(np.random.default_rng(0).random((50, 3))).export(tmp_path / "cloud.ply")
    for name in ("cut.ply", "cloud.ply"):
        with pytest.raises(WorldError, match=f"{name} cannot be read as a mesh: .+, expected"):
            read_mesh(tmp_path / name, slicing=MeshSlicing(), resolution=CELL_M)
    # As the limited process does, without starting one.
    for name in ("noise.glb", "empty.stl"):
        request = {
            "wanted": "triangles",
            "format": name[-3:],
            "log": str(tmp_path / name),
            "output": str(tmp_path),
            "limits": mesh_worlds.MESH_LIMITS.model_dump(mode="json"),
        }
        assert decode_request(request, scratch=tmp_path)["reason"] in REASONS


def test_a_few_bytes_that_unfold_to_too_many_triangles_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = trimesh.Scene()
    cube = trimesh.creation.box()
    scene.add_geometry(cube, geom_name="cube")
    for number in range(50):
        scene.graph.update(f"copy{number}", geometry="cube", matrix=np.eye(4))
    scene.export(tmp_path / "many.glb")
    monkeypatch.setattr("storage.mesh_triangles.MOST_TRIANGLES", 500)
    with pytest.raises(Exception, match="612 triangles, expected at most 500"):
        decode_triangles(tmp_path / "many.glb", tmp_path, format="glb")


def test_a_mesh_larger_than_allowed_is_not_even_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _mesh().export(tmp_path / "room.stl")
    limits = mesh_worlds.MESH_LIMITS.model_copy(update={"log_mib": 0})
    monkeypatch.setattr(mesh_worlds, "MESH_LIMITS", limits)
    with pytest.raises(WorldError, match="expected at most 0 MiB"):
        read_mesh(tmp_path / "room.stl", slicing=MeshSlicing(), resolution=CELL_M)


def test_a_mirrored_part_of_a_scene_keeps_its_outside(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box(), transform=np.diag((-1.0, 1.0, 1.0, 1.0)))
    scene.export(tmp_path / "box.glb")
    decode_triangles(tmp_path / "box.glb", tmp_path, format="glb")
    triangles = np.load(tmp_path / "triangles.npy", allow_pickle=False)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    assert (np.einsum("ij,ij->i", normals, triangles.mean(axis=1)) > 0.0).all()
