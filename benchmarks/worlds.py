"""Can generated worlds be told from real ones: BARN's from BARN, homes from scanned houses.

BARN: three sets of 300 generated worlds, each against the 300 originals, by the five measures
as its authors define them, path length, fill, and where paths begin and end; then all of them
at once by energy distance and by two classifiers, and the fields' texture by a third. The
originals' two halves, even against odd numbers, show what the same tests say of equals.

Homes: 10, 50 and 90 % of what single houses measure, for generated homes, the paper's furnished
houses (deployment and tuning parts) and bare plans; and what DWA slow makes of them.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from _barn_measures import MEASURES, barn_measures, texture
from _home_statistics import home_statistics
from _shared_worlds import barn_worlds, drawn_tasks, houses, shared_path
from _two_samples import (
    compare_points,
    compare_values,
    forest_separation,
    linear_separation,
)
from navigation import Setup, measured_row
from scipy.stats import spearmanr

from ses_core.arrays import FloatArray
from ses_core.navigation import World
from ses_core.worlds.cellular_automata import FIELD_CELLS, generate_barn
from ses_core.worlds.homes import generate_homes
from storage.world_sets import read_worlds

SEED = 2026
FIELD_BEGIN = 34
"""First row of a course that belongs to its field."""

PLAN_RESOLUTION_M = 0.01
HOME_PAIRS = 4
DRIVEN_PAIRS = 2

Row = dict[str, str | float]


def measure(scratch: Path, *, barn: int = 300, seeds: int = 3, homes: int = 50) -> list[Row]:
    """Give a row per test and per statistic."""
    rows = _barn_rows(scratch, barn, seeds)
    generated = generate_homes(homes, seed=SEED)
    scanned = houses("deployment", "tuning")[:: max(1, 50 // homes)]
    plans = read_worlds([shared_path("houses")], resolution=PLAN_RESOLUTION_M)
    rows += _home_rows(generated, scanned, plans[:: max(1, 50 // homes)])
    for name, worlds in (("homes", generated), ("scanned houses", scanned)):
        tasks = drawn_tasks(worlds, DRIVEN_PAIRS, seed=SEED)
        rows.append(measured_row(Setup(name=f"{name}, DWA slow, preset real"), tasks))
    return rows


def _barn_rows(scratch: Path, count: int, seeds: int) -> list[Row]:
    originals, textures = _originals(scratch, count)
    rows = _order_rows(originals)
    for seed in range(seeds):
        generated = generate_barn(count, seed=seed)
        points = np.array([barn_measures(each.field, each.path) for each in generated])
        ours = np.array([texture(each.field) for each in generated])
        rows += _told_apart(f"BARN, seed {seed}", points, originals, ours, textures)
    return rows + _told_apart(
        "BARN, originals' even against odd",
        originals[::2],
        originals[1::2],
        textures[::2],
        textures[1::2],
    )


def _order_rows(originals: FloatArray) -> list[Row]:
    """Give how measures of the originals go with their numbers: Spearman's correlation."""
    numbers = np.arange(len(originals))
    return [
        {
            "name": f"BARN, originals' numbers: {name}",
            "rho": _shown(spearmanr(numbers, originals[:, column]).statistic),
        }
        for column, name in enumerate(MEASURES)
    ]


def _originals(scratch: Path, count: int) -> tuple[FloatArray, FloatArray]:
    """Measure BARN's own worlds along BARN's own paths."""
    worlds = barn_worlds(scratch, range(count))
    fields = [world.grid.cells[FIELD_BEGIN : FIELD_BEGIN + FIELD_CELLS].T for world in worlds]
    folder = scratch / "barn" / "BARN" / "path_files"
    # A published path names its start twice.
    paths = [np.load(folder / f"path_{number}.npy")[1:] for number in range(count)]
    points = [barn_measures(*pair) for pair in zip(fields, paths, strict=True)]
    return np.array(points), np.array([texture(field) for field in fields])


def _told_apart(
    name: str,
    ours: FloatArray,
    theirs: FloatArray,
    our_textures: FloatArray,
    their_textures: FloatArray,
) -> list[Row]:
    """Give a row per measure, and one per test of all of them at once."""
    rows: list[Row] = []
    for column, measure_name in enumerate(MEASURES):
        mine, other = ours[:, column], theirs[:, column]
        found = compare_values(mine, other, seed=SEED)
        rows.append(
            {
                "name": f"{name}: {measure_name}",
                "ours": _shown(mine.mean()),
                "theirs": _shown(other.mean()),
                "ours_sd": _shown(mine.std()),
                "theirs_sd": _shown(other.std()),
                "distance": _shown(found.statistic),
                "p": _shown(found.p),
            }
        )
    energy = compare_points(ours, theirs, seed=SEED)
    rows.append(
        {
            "name": f"{name}: all, energy distance",
            "distance": _shown(energy.statistic),
            "p": _shown(energy.p),
        }
    )
    for test, separation in (
        ("all, logistic regression", partial(linear_separation, ours, theirs)),
        ("all, random forest", partial(forest_separation, ours, theirs)),
        ("texture, random forest", partial(forest_separation, our_textures, their_textures)),
    ):
        auc, low, high = separation(seed=SEED)
        rows.append(
            {"name": f"{name}: {test}", "auc": _shown(auc), "from": _shown(low), "to": _shown(high)}
        )
    return rows


def _home_rows(
    homes: Sequence[World], scanned: Sequence[World], plans: Sequence[World]
) -> list[Row]:
    """Give quantiles per statistic, and how far homes are from scanned houses."""
    ours, theirs, bare = (
        [home_statistics(world, pairs=HOME_PAIRS, seed=SEED) for world in worlds]
        for worlds in (homes, scanned, plans)
    )
    rows: list[Row] = []
    for statistic in ours[0]:
        mine, other, plain = (
            np.array([row[statistic] for row in table]) for table in (ours, theirs, bare)
        )
        known, known_other = mine[np.isfinite(mine)], other[np.isfinite(other)]
        low, high = np.percentile(known_other, (10, 90))
        rows.append(
            {
                "name": f"homes: {statistic}",
                **_quantiles("ours", mine),
                **_quantiles("scanned", other),
                **_quantiles("plans", plain),
                "distance": _shown(compare_values(known, known_other, seed=SEED).statistic),
                "median_inside": float(low <= np.median(known) <= high),
                "share_inside": _shown(np.mean((low <= known) & (known <= high))),
            }
        )
    shares = [
        float(np.mean([np.isfinite(row["bottleneck [m]"]) for row in table]))
        for table in (ours, theirs, bare)
    ]
    names = ("ours_50", "scanned_50", "plans_50")
    rows.append({"name": "homes: share with pairs", **dict(zip(names, shares, strict=True))})
    return rows


def _quantiles(name: str, values: FloatArray) -> dict[str, float]:
    known = values[np.isfinite(values)]
    return {f"{name}_{share}": _shown(np.percentile(known, share)) for share in (10, 50, 90)}


def _shown(value: float | np.floating) -> float:
    return round(float(value), 3)
