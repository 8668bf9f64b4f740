"""How well a place driven again bears out its label from the log, by how the place is rebuilt.

DWA slow is deployed in the paper's houses, its logs are cut into scenarios, and it drives each
again in the place as it is rebuilt and as it might be. Chance alone is measured beside it: two
drives in the true place agree no better than `true place, twice` says.
"""

from pathlib import Path

import numpy as np
from _driven_scenarios import DrivenScenario, driven_scenarios
from _reconstruction_variants import FORMS, Form, true_place
from _shared_worlds import drawn_tasks, houses

from ses_core.arrays import FloatArray, IntArray
from ses_core.evaluation.difficulty import VerifiedDifficulty, difficulties
from ses_core.evaluation.label_agreement import label_agreement
from ses_core.evaluation.trials import evaluate, evaluation_task
from ses_core.learning.policies import FIXED_POLICIES
from ses_core.robot_profile import JACKAL
from ses_core.settings import FilterSettings, SimulationSettings

DRIVER = "dwa-slow"
PAIRS_PER_HOUSE = 24
MOST_OTHERS = 300
"""Scenarios that the log does not call challenging: more of them say little and take long."""
TRIALS = 2
SEED = 2026
RESAMPLES = 1000

Row = dict[str, str | float]
STATISTICS = ("correlation", "auc", "hard_again")


def measure(
    scratch: Path,  # noqa: ARG001 - what every benchmark takes
    *,
    house_count: int | None = None,
    pairs: int = PAIRS_PER_HOUSE,
    trials: int = TRIALS,
) -> list[Row]:
    """Give one row per form of the place and per count, with intervals over houses."""
    simulation = SimulationSettings()
    scenarios = driven_scenarios(
        drawn_tasks(houses("deployment")[:house_count], pairs, seed=SEED),
        FIXED_POLICIES[DRIVER],
        seed=SEED,
        simulation=simulation,
        profile=JACKAL,
    )
    scenarios = _chosen(scenarios)
    names, house = np.unique([one.house.world_id for one in scenarios], return_inverse=True)
    draws = _draws(house.astype(np.int64), len(names))
    simulated = {
        name: _drive(scenarios, form, trials, SEED, simulation) for name, form in FORMS.items()
    }
    again = _drive(scenarios, true_place, trials, SEED + 1, simulation)
    default = next(iter(FORMS))
    rows = []
    for label, column in _COUNTS.items():
        logged = np.array([_logged(one, label) for one in scenarios])
        scores = {name: _scores(found, column) for name, found in simulated.items()}
        for name, found in simulated.items():
            success = float(np.mean([one.success_rate for one in found]))
            reference = None if name == default else scores[default]
            rows.append(_row(name, label, success, logged, scores[name], draws, reference))
        success = float(np.mean([one.success_rate for one in again]))
        labelled_by = _COUNTS["negative"] if label == _BY_TIME else column
        first = _scores(simulated["true place"], labelled_by)
        rows.append(_row("true place, twice", label, success, first, _scores(again, column), draws))
    return rows


_BY_TIME = "negative, by time"

_COUNTS = {
    "negative": "negative_velocity_count",
    "not forward": "not_forward_count",
    _BY_TIME: "restricted_mean_time_s",
}
"""What is set against the log, and what stands for it in the place driven again."""


def _chosen(scenarios: list[DrivenScenario]) -> list[DrivenScenario]:
    """Keep every challenging scenario and some of the others, in their order."""
    counts = np.array([_logged(one, "negative") for one in scenarios])
    is_kept = counts > FilterSettings().threshold
    others = np.random.default_rng(SEED).permutation(np.flatnonzero(~is_kept))
    is_kept[others[:MOST_OTHERS]] = True
    return [scenarios[number] for number in np.flatnonzero(is_kept)]


def _logged(one: DrivenScenario, label: str) -> float:
    scenario = one.scenario
    count = scenario.negative_velocity_count
    if label == "not forward":
        count = scenario.not_forward_count
    assert count is not None, "the simulated fleet's velocities are all known"
    return float(count)


def _drive(
    scenarios: list[DrivenScenario],
    form: Form,
    trials: int,
    seed: int,
    simulation: SimulationSettings,
) -> list[VerifiedDifficulty]:
    return difficulties(
        evaluate(
            {DRIVER: FIXED_POLICIES[DRIVER]},
            [evaluation_task(form(one), pair=0, profile=JACKAL) for one in scenarios],
            trials=trials,
            seed=seed,
            simulation=simulation,
            profile=JACKAL,
        )
    )


def _scores(found: list[VerifiedDifficulty], column: str) -> FloatArray:
    return np.array([float(getattr(one, column)) for one in found])


def _draws(house: IntArray, count: int) -> list[IntArray]:
    """Draw houses with replacement, and give the scenarios (N,) of each draw."""
    rng = np.random.default_rng(SEED)
    members = [np.flatnonzero(house == number) for number in range(count)]
    return [
        np.concatenate([members[number] for number in rng.integers(count, size=count)])
        for _ in range(RESAMPLES)
    ]


def _row(
    name: str,
    label: str,
    success: float,
    logged: FloatArray,
    scores: FloatArray,
    draws: list[IntArray],
    reference: FloatArray | None = None,
) -> Row:
    threshold = FilterSettings().threshold
    found = label_agreement(logged, scores, threshold=threshold)
    row: Row = {
        "place": name,
        "count": label,
        "scenarios": found.places,
        "challenging": found.challenging,
        "success": round(success, 3),
    }
    drawn = _statistics(logged, scores, draws, threshold)
    gains = None if reference is None else drawn - _statistics(logged, reference, draws, threshold)
    for column, statistic in enumerate(STATISTICS):
        if label == _BY_TIME and statistic == "hard_again":
            continue  # Seconds have no threshold of steps.
        value = getattr(found, statistic)
        row[statistic] = "-" if value is None else f"{value:.3f}"
        row[f"{statistic} interval"] = _interval(drawn[:, column])
        row[f"{statistic} gained"] = "-" if gains is None else _interval(gains[:, column])
    return row


def _statistics(
    logged: FloatArray, scores: FloatArray, draws: list[IntArray], threshold: float
) -> FloatArray:
    """Give the statistics (D, 3) of each draw; nan where one is not defined."""
    found = [label_agreement(logged[draw], scores[draw], threshold=threshold) for draw in draws]
    values = [[getattr(one, statistic) for statistic in STATISTICS] for one in found]
    return np.array(values, dtype=np.float64)


def _interval(values: FloatArray) -> str:
    if np.isnan(values).all():
        return "-"
    low, high = np.nanquantile(values, (0.025, 0.975))
    return f"{low:+.2f} to {high:+.2f}"
