"""The shared worlds that benchmarks drive in: BARN's, and the paper's own houses."""

import os
import tarfile
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from ses_core.navigation import NavigationTask, World
from ses_core.robot_profile import JACKAL
from ses_core.worlds.pairs import sample_tasks
from storage.world_sets import read_worlds

HOUSE_RESOLUTION_M = 0.03


def shared_path(*parts: str) -> Path:
    """Give a path below the shared data: `$SES_SHARED_DATA`, else beside the checkout.

    Raises:
        SystemExit: It is not there.
    """
    beside = Path(__file__).parents[2] / "shared" / "data"
    path = Path(os.environ.get("SES_SHARED_DATA", beside)).joinpath(*parts)
    if not path.exists():
        raise SystemExit(
            f"shared data {'/'.join(parts)} is missing, expected it in $SES_SHARED_DATA"
        )
    return path


def barn_worlds(scratch: Path, numbers: Iterable[int]) -> list[World]:
    """Unpack BARN and read the worlds of these numbers (0 to 299)."""
    with tarfile.open(shared_path("barn", "BARN_300_worlds_and_paths.tar.xz")) as archive:
        archive.extractall(scratch / "barn", filter="data")
    files = {file.name: file for file in (scratch / "barn").rglob("*.world")}
    return read_worlds([files[f"world_{number}.world"] for number in numbers])


def houses(*parts: str) -> list[World]:
    """Read the houses of some parts of the shared split, e.g. `tuning`."""
    folder = shared_path("matterport")
    return [
        world
        for part in parts
        for world in read_worlds([folder], part=part, resolution=HOUSE_RESOLUTION_M)
    ]


def drawn_tasks(worlds: Sequence[World], pairs: int, *, seed: int) -> list[NavigationTask]:
    """Draw start-goal pairs at least 6.6 m apart, so many in each world that has any."""
    rng = np.random.default_rng(seed)
    return [
        task for world in worlds for task in sample_tasks(world, pairs, profile=JACKAL, rng=rng)
    ]
