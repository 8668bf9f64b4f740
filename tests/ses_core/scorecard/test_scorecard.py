import numpy as np
import pytest

from ses_core.scorecard.rows import ScorecardRow
from ses_core.scorecard_settings import ScorecardSettings
from tests.ses_core.scorecard.samples import QUICK, pillars, row, score, sites
from tests.ses_core.synthesis.places import walled_off

REAL = pillars(60, seed=0)
GROUPS = sites(*(6,) * 10)


def test_places_of_the_same_kind_reach_the_real_against_real_values() -> None:
    found = score(REAL, pillars(60, seed=1), GROUPS)
    for metric in ("precision", "recall", "coverage"):
        one = row(found, metric)
        assert one.halves == "by site (10)"
        assert (one.value or 0.0) > 0.85 * (one.real_value or 1.0)
        assert (one.low or 9.0) <= (one.value or 0.0) <= (one.high or 0.0)
    mmd = row(found, "MMD^2", "clearance")
    assert (mmd.p_value or 0.0) > 0.05
    assert "Gaussian kernel of the median distance" in mmd.feature


def test_places_of_another_kind_miss_them() -> None:
    found = score(REAL, pillars(60, seed=1, most=40), GROUPS)
    assert (row(found, "coverage").value or 0.0) < 0.5 * (row(found, "coverage").real_value or 0.0)
    assert row(found, "MMD^2").p_value == 0.02
    for name in ("occupancy", "components", "perimeter", "visibility"):
        one = row(found, f"Wasserstein-1 {name}")
        assert (one.value or 0.0) > 2.0 * (one.real_value or 9.0), name
    crowded, sparse = row(found, "mean components").value, row(found, "mean components").real_value
    assert (crowded or 0.0) > 2 * (sparse or 9.0)


def test_traversability_is_told_as_drawn_and_as_handed_on() -> None:
    few = REAL[:5]
    found = score(few, np.concatenate((REAL[:3], walled_off(1))), raw_traversable=0.25)
    assert row(found, "traversable, raw").value == 0.25
    assert row(found, "traversable, shipped").value == 0.75
    assert row(found, "traversable, shipped").real_value == 1.0
    unknown = row(score(few, REAL[:3]), "traversable, raw")
    assert unknown.value is None
    assert unknown.note.startswith("unknown")


@pytest.mark.parametrize(
    ("real", "made"), [(0, 0), (0, 30), (1, 1), (5, 5), (30, 0), (30, 1), (30, 5), (30, 30)]
)
def test_few_environments_give_numbers_or_say_why_not(real: int, made: int) -> None:
    found = score(pillars(real, seed=0), pillars(made, seed=1))
    assert len(found.rows) == 42
    for one in found.rows:
        numbers = _numbers(one)
        assert all(np.isfinite(number) for number in numbers if number is not None), one
        is_silent = one.value is None and not one.note
        assert not is_silent, one
    if min(real, made) >= 30:
        is_driven = {"success", "time", "reversing steps"}
        assert not [
            one
            for one in found.rows
            if one.value is None
            and one.metric.removeprefix("mean ").removeprefix("Wasserstein-1 ") not in is_driven
            and one.metric != "traversable, raw"
        ]
    else:
        assert row(found, "coverage").note.startswith("too few")


def test_drives_tell_how_hard_places_are_for_a_policy() -> None:
    settings = ScorecardSettings(halvings=4, permutations=19, driven=12)
    blocked = walled_off(12)
    found = score(REAL[:12], blocked, sites(*(2,) * 6), settings=settings)
    assert row(found, "mean success", "drives of dwa-slow").value == 0.0
    # As many synthesized drives as held-out real ones: a distance depends on how many there are.
    assert row(found, "Wasserstein-1 time").n_synthesized == 6
    assert (row(found, "mean success").real_value or 0.0) > 0.8
    assert row(found, "mean time").value == 100.0
    assert (row(found, "mean time").real_value or 99.0) < 60.0
    time = row(found, "Wasserstein-1 time")
    assert (time.value or 0.0) > 3.0 * (time.real_value or 99.0)
    same = score(REAL[:12], REAL[:12], sites(*(2,) * 6), settings=settings)
    assert row(same, "mean time").value == row(same, "mean time").real_value


def test_the_same_seed_gives_the_same_scorecard() -> None:
    real, made = REAL[:12], pillars(6, seed=1)
    first, second = score(real, made), score(real, made)
    assert first.rows == second.rows
    other = QUICK.model_copy(update={"seed": 1})
    assert first.rows != score(real, made, settings=other).rows


def _numbers(one: ScorecardRow) -> list[float | None]:
    return [
        one.value,
        one.low,
        one.high,
        one.real_value,
        one.real_low,
        one.real_high,
        one.p_value,
        one.real_p_value,
    ]
