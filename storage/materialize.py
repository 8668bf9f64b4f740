"""`materialize`: find what a recipe asks for, or build it once."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ses_core.protocols import ArtifactStore
from ses_core.recipes import ArtifactRef, Recipe


@dataclass(frozen=True, slots=True, kw_only=True)
class Materialized:
    """An artifact and how it was come by.

    Attributes:
        found: Whether it was there already.
        seconds: What finding or building it took [s].
    """

    ref: ArtifactRef
    found: bool
    seconds: float


def materialize(
    store: ArtifactStore, recipe: Recipe, build: Callable[[Path], None], *, anew: bool = False
) -> Materialized:
    """Give the artifact that a recipe asks for, building it only where it is not there.

    Args:
        store: Where it is kept.
        recipe: What is asked for.
        build: Builds it into an empty folder.
        anew: Build it although it is there.

    Raises:
        ArtifactError: The disk is full or failing. Errors of `build` pass through.
    """
    started = time.perf_counter()
    if anew:
        store.forget(recipe)
    found = store.find(recipe)
    ref = found if found is not None else store.put(recipe, build)
    return Materialized(
        ref=ref, found=found is not None, seconds=round(time.perf_counter() - started, 3)
    )
