"""How far the batch simulator can be trusted: the same drives and trials in PyBullet.

Open loop: the same commands for two seconds. Closed loop: the same trials under four policies,
batch against PyBullet, beside batch against batch with another noise seed: no simulator can
agree better with another than with itself.
"""

import os
import tarfile
from pathlib import Path

import numpy as np
from _open_loop import open_loop_errors

from ses_core.evaluation.episodes import Episode
from ses_core.evaluation.fidelity import Fidelity, fidelity
from ses_core.evaluation.trials import EvaluationTask, evaluate, evaluation_task
from ses_core.learning.policies import FIXED_POLICIES, FixedParameters
from ses_core.planning.parameters import PlannerParameters
from ses_core.protocols import Policy
from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings
from ses_core.worlds.pairs import sample_tasks
from storage.world_sets import read_worlds

POLICIES: dict[str, Policy] = {
    **FIXED_POLICIES,
    # Two more that differ in what matters: quick with a thin rim, and slow with a thick one.
    "quick": FixedParameters(
        PlannerParameters(max_vel_x=1.5, vx_samples=12.0, inflation_radius=0.25)
    ),
    "shy": FixedParameters(PlannerParameters(max_vel_x=0.4, inflation_radius=0.45)),
}
BARN_TEST_WORLDS = range(0, 300, 6)
PAIRS_PER_HOUSE = 4
SEED = 2026


def measure(scratch: Path, *, barn: int = 50, houses: int = 10) -> list[dict[str, str | float]]:
    """Give open-loop errors and closed-loop agreement as rows."""
    rows = [
        _row(f"open loop, {kind}: p90 after 2 s", "m", float(np.quantile(found, 0.9)), 0.05)
        for kind, found in _open_loop().items()
    ]
    places = _barn_places(scratch, barn) + _house_places(houses)
    sides = {
        name: _drive(places, seed=seed, simulator=simulator)
        for name, seed, simulator in (
            ("batch", SEED, "batch"),
            ("bullet", SEED, "bullet"),
            ("again", SEED + 1, "batch"),
        )
    }
    physical = fidelity(sides["batch"], sides["bullet"])
    ceiling = fidelity(sides["batch"], sides["again"])
    rows += _closed_loop_rows(physical, ceiling)
    for name in POLICIES:
        rows.append(_success_row(name, sides["bullet"], sides["batch"]))
    return rows


def _open_loop() -> dict[str, np.ndarray]:
    errors = open_loop_errors(JACKAL)
    return {**errors, "all": np.concatenate(list(errors.values()))}


def _closed_loop_rows(physical: Fidelity, ceiling: Fidelity) -> list[dict[str, str | float]]:
    return [
        _row("paired trials", "trials", physical.trials, ceiling.trials),
        _row("outcome agreement", "share", physical.agreement, ceiling.agreement),
        _row("Cohen's kappa", "", physical.kappa, ceiling.kappa),
        _row(
            "Spearman, negative counts", "", physical.count_correlation, ceiling.count_correlation
        ),
        _row("mean time, PyBullet over batch", "", physical.time_ratio, ceiling.time_ratio),
        _row("same ranking of policies", "", physical.same_ranking, ceiling.same_ranking),
    ]


def _success_row(
    policy: str, bullet: list[Episode], batch: list[Episode]
) -> dict[str, str | float]:
    shares = [
        float(np.mean([e.outcome == "success" for e in side if e.policy == policy]))
        for side in (bullet, batch)
    ]
    return _row(f"success of {policy}, PyBullet and batch", "share", *shares)


def _row(name: str, unit: str, ours: float, theirs: float) -> dict[str, str | float]:
    return {
        "name": name,
        "unit": unit,
        "ours": round(float(ours), 4),
        "theirs": round(float(theirs), 4),
        "ratio": round(float(ours) / float(theirs), 3) if theirs else float("nan"),
    }


def _drive(places: list[EvaluationTask], *, seed: int, simulator: str) -> list[Episode]:
    return evaluate(
        POLICIES,
        places,
        trials=1,
        seed=seed,
        simulation=SimulationSettings(),
        profile=JACKAL,
        simulator=simulator,
        slots=64 if simulator == "batch" else 8,
    )


def _shared(*parts: str) -> Path:
    """Give a path below the shared data: `$SES_SHARED_DATA`, else beside the checkout."""
    beside = Path(__file__).parents[2] / "shared" / "data"
    path = Path(os.environ.get("SES_SHARED_DATA", beside)).joinpath(*parts)
    if not path.exists():
        raise SystemExit(f"{path} is missing, expected the shared data: set SES_SHARED_DATA")
    return path


def _barn_places(scratch: Path, count: int) -> list[EvaluationTask]:
    with tarfile.open(_shared("barn", "BARN_300_worlds_and_paths.tar.xz")) as archive:
        archive.extractall(scratch / "barn", filter="data")
    files = {file.name: file for file in (scratch / "barn").rglob("*.world")}
    chosen = [files[f"world_{number}.world"] for number in list(BARN_TEST_WORLDS)[:count]]
    rng = np.random.default_rng(SEED)
    return [
        evaluation_task(task, pair=0, profile=JACKAL)
        for world in read_worlds(chosen)
        for task in sample_tasks(world, 1, profile=JACKAL, rng=rng)
    ]


def _house_places(count: int) -> list[EvaluationTask]:
    houses = read_worlds([_shared("matterport")], part="tuning", resolution=0.03)[:count]
    rng = np.random.default_rng(SEED)
    return [
        evaluation_task(task, pair=pair, profile=JACKAL)
        for world in houses
        for pair, task in enumerate(sample_tasks(world, PAIRS_PER_HOUSE, profile=JACKAL, rng=rng))
    ]
