"""Meshes of buildings (`.glb .ply .obj .stl`), sliced into maps.

A mesh is parsed in the limited process; what comes back are triangles.
"""

import tempfile
from pathlib import Path
from typing import Final, Literal

import numpy as np

from ses_core.arrays import Float32Array
from ses_core.errors import LogError, NotAMapError, WorldError
from ses_core.navigation import World
from ses_core.settings import DecoderLimits
from ses_core.worlds.identity import named_world
from ses_core.worlds.mesh_slicing import MeshSlicing, slice_mesh
from storage.limited_process import decoded_in_child
from storage.world_files import named_errors

_UP_BY_SUFFIX: Final[dict[str, Literal["y", "z"]]] = {
    # glTF lays y down as up; scanners (Matterport's among them) write the others with z up.
    ".glb": "y",
    ".ply": "z",
    ".obj": "z",
    ".stl": "z",
}
MESH_SUFFIXES: Final = frozenset(_UP_BY_SUFFIX)

MESH_LIMITS: Final = DecoderLimits(memory_mib=6144, log_mib=2048, output_mib=1024)
"""A house of five million triangles with its textures takes 2 GiB to parse."""


def read_mesh(path: Path, *, slicing: MeshSlicing, resolution: float) -> World:
    """Read a mesh and slice it into cells of `resolution` [m].

    Raises:
        NotAMapError: It has no triangle: points or lines alone.
        WorldError: It cannot be read, or there is nothing to slice.
    """
    suffix = path.suffix.lower()
    triangles = _triangles(path, suffix)
    up = _UP_BY_SUFFIX[suffix] if slicing.up == "auto" else slicing.up
    with named_errors(path):
        grid = slice_mesh(triangles, slicing, up=up, resolution=resolution)
    return named_world(path.stem, grid, source="mesh")


def _triangles(path: Path, suffix: str) -> Float32Array:
    request = {"wanted": "triangles", "format": suffix.removeprefix(".")}
    with tempfile.TemporaryDirectory(prefix="ses-mesh-") as folder:
        try:
            with decoded_in_child(
                path, request, limits=MESH_LIMITS, workdir=Path(folder)
            ) as output:
                triangles = np.load(output / "triangles.npy", allow_pickle=False)
        except (LogError, OSError, ValueError) as error:
            is_empty = isinstance(error, LogError) and error.reason == "empty"
            raise (NotAMapError if is_empty else WorldError)(
                f"{path} cannot be read as a mesh: {error}, expected a whole {suffix} file of "
                "triangles in metres"
            ) from error
    if triangles.dtype != np.float32 or triangles.shape[1:] != (3, 3):
        raise WorldError(f"{path} was decoded to {triangles.dtype} {triangles.shape}")
    return np.asarray(triangles)
