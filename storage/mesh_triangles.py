"""A mesh file to plain triangles; only in the limited process (leaf: trimesh)."""

from pathlib import Path

import numpy as np
import trimesh

from ses_core.errors import LogError

MOST_TRIANGLES = 20_000_000
"""A scanned house has one to five million."""


def decode_triangles(file: Path, output: Path, *, format: str) -> None:  # noqa: A002
    """Write a mesh's triangles (N, 3, 3) as `triangles.npy`, each part where its scene puts it.

    Materials are left out: nothing is opened but the file itself.

    Raises:
        LogError: It has no triangle, or too many.
    """
    with file.open("rb") as content:
        scene = trimesh.load_scene(content, file_type=format, process=False, skip_materials=True)
    # A part may stand at many places: what a file of kilobytes unfolds to is counted first.
    parts = [
        (transform, mesh)
        for transform, name in (scene.graph[node] for node in scene.graph.nodes_geometry)
        if isinstance(mesh := scene.geometry[name], trimesh.Trimesh)
    ]
    count = sum(len(mesh.faces) for _, mesh in parts)
    if count > MOST_TRIANGLES:
        raise LogError("size_limit", f"{count} triangles, expected at most {MOST_TRIANGLES}")
    pieces = []
    for transform, mesh in parts:
        corners = np.asarray(mesh.vertices) @ transform[:3, :3].T + transform[:3, 3]
        faces = np.asarray(mesh.faces)
        if np.linalg.det(transform[:3, :3]) < 0.0:
            # A mirror turns faces inside out: they are wound back.
            faces = faces[:, ::-1]
        pieces.append(corners.astype(np.float32)[faces])
    triangles = np.concatenate(pieces) if pieces else np.zeros((0, 3, 3), dtype=np.float32)
    triangles = triangles[np.isfinite(triangles).all(axis=(1, 2))]
    if not len(triangles):
        raise LogError("empty", "it has no triangle (a cloud of points is no mesh)")
    np.save(output / "triangles.npy", triangles, allow_pickle=False)
