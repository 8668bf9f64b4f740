"""BARN's arrays: fields (`.npy` of 30 x 30 cells) and the paths that cross them.

A path is rows (K, 2) of (row, column) in its field, from column 0 to column 29. BARN's protocol
gives every world the same start and goal; the authors of SES drove from one metre before the
path's start to beyond its end instead.
"""

import io
import math
import tokenize
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ses_core.arrays import BoolArray, IntArray
from ses_core.errors import NotAMapError, WorldError
from ses_core.geometry import Pose2D
from ses_core.navigation import World
from ses_core.worlds.cellular_automata import (
    CELL_M,
    COURSE_GOAL,
    COURSE_ORIGIN,
    COURSE_START,
    FIELD_CELLS,
    FIELD_START_M,
    barn_course,
)
from ses_core.worlds.identity import Course, named_world
from storage.world_files import first_line

BarnCourse = Literal["protocol", "path"]

_RUN_UP_M = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class BarnArray:
    """What an array of BARN's is: a field (30, 30), True = occupied, or a path (K, 2) of cells."""

    field: BoolArray | None = None
    path: IntArray | None = None


def read_barn_array(path: Path, content: bytes) -> BarnArray:
    """Read a field or a path.

    Raises:
        NotAMapError: It is some other array.
        WorldError: It is no array of numbers.
    """
    try:
        array: NDArray[Any] = np.load(io.BytesIO(_within_claims(content)), allow_pickle=False)
    except (ValueError, OSError, EOFError, SyntaxError, tokenize.TokenError) as error:
        raise WorldError(f"{path} is no array of numbers: {first_line(error)}") from error
    if isinstance(array, np.ndarray) and array.dtype.kind in "biuf":
        if array.shape == (FIELD_CELLS, FIELD_CELLS) and np.isin(array, (0, 1)).all():
            return BarnArray(field=array.astype(np.bool_))
        is_path = array.ndim == 2 and array.shape[1] == 2 and len(array) > 0
        if is_path and bool(((array >= 0) & (array < FIELD_CELLS)).all()):
            return BarnArray(path=array.astype(np.int64))
    raise NotAMapError(
        f"{path} is no array of BARN's, expected its field of 30 x 30 zeros and ones or its path "
        "(K, 2) of cells"
    )


def _within_claims(content: bytes) -> bytes:
    """Give an array's file back if it holds what its header claims: memory is taken by that."""
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"version {version} of the format, expected 1.0 or 2.0")
    is_first = version == (1, 0)
    shape, _, dtype = (
        np.lib.format.read_array_header_1_0(stream)
        if is_first
        else np.lib.format.read_array_header_2_0(stream)
    )
    claimed, held = math.prod(shape) * dtype.itemsize, len(content) - stream.tell()
    if min(shape, default=0) < 0 or claimed > held:
        raise ValueError(f"its header claims {shape} of {dtype}, but {held} bytes follow")
    return content


def barn_field(path: Path, field: BoolArray) -> World:
    """Stand a field in BARN's course."""
    return named_world(
        path.stem, barn_course(field), source="barn", course=(COURSE_START, COURSE_GOAL)
    )


def path_course(cells: IntArray) -> Course:
    """Give start and goal by a path: a metre before its start, and on the protocol's goal line."""
    (start_x, start_y), (goal_x, _) = (
        (
            COURSE_ORIGIN[0] + (row + 0.5) * CELL_M,
            FIELD_START_M + (column + 0.5) * CELL_M,
        )
        for row, column in (cells[0].tolist(), cells[-1].tolist())
    )
    return Pose2D(start_x, start_y - _RUN_UP_M, math.pi / 2), (goal_x, COURSE_GOAL[1])
