"""How far the batch simulator can be trusted: the same drives and trials in PyBullet.

Open loop: the same commands for two seconds. Closed loop: the same trials under four policies,
batch against PyBullet, beside batch against batch with another noise seed: no simulator can
agree better with another than with itself. Also draws `docs/fidelity.png`.
"""

from collections import Counter
from pathlib import Path

import numpy as np
from _open_loop import open_loop_errors
from _shared_worlds import barn_worlds, drawn_tasks, houses

from ses_core.evaluation.episodes import Episode
from ses_core.evaluation.fidelity import Fidelity, fidelity
from ses_core.evaluation.trials import EvaluationTask, evaluate, evaluation_task
from ses_core.learning.policies import FIXED_POLICIES, FixedParameters
from ses_core.navigation import NavigationTask
from ses_core.pictures.fidelity_figure import fidelity_figure
from ses_core.planning.parameters import PlannerParameters
from ses_core.protocols import Policy
from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings

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
FIGURE = Path(__file__).parents[1] / "docs" / "fidelity.png"


def measure(
    scratch: Path, *, barn: int = 50, house_count: int = 10
) -> list[dict[str, str | float]]:
    """Give open-loop errors and closed-loop agreement as rows."""
    errors = open_loop_errors(JACKAL)
    pooled = {**errors, "all": np.concatenate(list(errors.values()))}
    rows = [
        _row(f"open loop, {kind}: p90 after 2 s", "m", float(np.quantile(found, 0.9)), 0.05)
        for kind, found in pooled.items()
    ]
    courses = barn_worlds(scratch, list(BARN_TEST_WORLDS)[:barn])
    tasks = drawn_tasks(courses, 1, seed=SEED)
    tasks += drawn_tasks(houses("tuning")[:house_count], PAIRS_PER_HOUSE, seed=SEED)
    places = _places(tasks)
    sides = {
        name: _drive(places, seed=seed, simulator=simulator)
        for name, seed, simulator in (
            ("batch", SEED, "batch"),
            ("bullet", SEED, "bullet"),
            ("again", SEED + 1, "batch"),
        )
    }
    FIGURE.write_bytes(fidelity_figure(errors, sides["batch"], sides["bullet"]))
    physical = fidelity(sides["batch"], sides["bullet"])
    ceiling = fidelity(sides["batch"], sides["again"])
    rows += _closed_loop_rows(physical, ceiling)
    for name in POLICIES:
        rows.append(_success_row(name, sides["bullet"], sides["batch"]))
    return rows


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


def _places(tasks: list[NavigationTask]) -> list[EvaluationTask]:
    """Number the pairs of each world from 0."""
    drawn: Counter[str] = Counter()
    places = []
    for task in tasks:
        world = task.world.world_id
        places.append(evaluation_task(task, pair=drawn[world], profile=JACKAL))
        drawn[world] += 1
    return places
