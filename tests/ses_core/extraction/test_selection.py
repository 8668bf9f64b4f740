"""The filter: from tables of scenarios and environments to the pool."""

from datetime import date

import numpy as np
import pandas as pd
import pytest

from ses_core.extraction.selection import Selection, select_challenging
from ses_core.settings import FilterSettings

LAST = date(2026, 11, 22)
ALL_TRAINING = FilterSettings(heldout_share=0.0)


def tables(count: int = 0, **columns: object) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Make `count` good scenarios of a robot with counts 51, 52, ..., some columns replaced."""
    names = [f"scenario-{number:04d}" for number in range(count)]
    counts = np.arange(51, 51 + count)
    defaults: dict[str, object] = {
        "scenario_id": names,
        "environment_id": [f"environment-{name}" for name in names],
        "log_id": [f"log-{number % 7}" for number in range(count)],
        "robot": "r1",
        "site": "home",
        "batch_date": LAST.isoformat(),
        "kind": "scenario",
        "negative_velocity_count": pd.array(counts, dtype="Int64"),
        "not_forward_count": pd.array(counts + 100, dtype="Int64"),
        "reversing_s": counts / 20.0,
        "start_x_m": 0.0,
        "start_y_m": 0.0,
        "goal_x_m": 5.0,
        "goal_y_m": 0.0,
    }
    places: dict[str, object] = {
        "environment_id": defaults["environment_id"],
        "scenario_id": names,
        "is_traversable": True,
        "path_in_free_fraction": 1.0,
        "observed_fraction": 0.6,
        "contradicted_fraction": 0.1,
    }
    for column, values in columns.items():
        (defaults if column in defaults else places)[column] = values
    return pd.DataFrame(defaults, index=range(count)), pd.DataFrame(places, index=range(count))


def select(
    rows: tuple[pd.DataFrame, pd.DataFrame], settings: FilterSettings = ALL_TRAINING
) -> Selection:
    return select_challenging(*rows, settings=settings, last_batch=LAST)


def test_the_threshold_is_strict() -> None:
    rows = tables(3, negative_velocity_count=pd.array([49, 50, 51], dtype="Int64"))
    assert select(rows).pool["scenario_id"].tolist() == ["scenario-0002"]


def test_the_pool_is_ranked_hardest_first_and_ties_by_identity() -> None:
    rows = tables(4, negative_velocity_count=pd.array([60, 99, 60, 80], dtype="Int64"))
    expected = ["scenario-0001", "scenario-0003", "scenario-0000", "scenario-0002"]
    for order in ([0, 1, 2, 3], [2, 3, 0, 1], [3, 2, 1, 0]):
        shuffled = (rows[0].iloc[order], rows[1].iloc[order[::-1]])
        pool = select(shuffled).pool
        assert pool["scenario_id"].tolist() == expected
        assert pool["rank"].tolist() == [1, 2, 3, 4]
        assert pool["count"].tolist() == [99.0, 80.0, 60.0, 60.0]


def test_unknown_counts_and_terminal_segments_are_never_chosen() -> None:
    rows = tables(
        4,
        negative_velocity_count=pd.array([None, 500, 60, 0], dtype="Int64"),
        kind=["scenario", "terminal", "scenario", "scenario"],
    )
    for settings in (
        ALL_TRAINING,
        FilterSettings(challenging_share=1.0, heldout_share=0.0),
    ):
        selection = select(rows, settings)
        assert selection.pool["scenario_id"].tolist() == ["scenario-0002"]
        assert selection.funnels["negative"].unknown == 1
        assert selection.funnels["negative"].terminal == 1


@pytest.mark.parametrize(("share", "expected"), [(0.23, 23), (0.001, 1), (1.0, 100)])
def test_a_share_takes_the_hardest_of_those_with_a_known_count(share: float, expected: int) -> None:
    counts = pd.array([*range(1, 101), None, None], dtype="Int64")
    selection = select(
        tables(102, negative_velocity_count=counts),
        FilterSettings(challenging_share=share, heldout_share=0.0),
    )
    assert len(selection.pool) == expected
    assert selection.pool["count"].tolist() == list(range(100, 100 - expected, -1))


def test_the_window_ends_with_the_last_batch() -> None:
    days = ["2026-10-23", "2026-10-24", "2026-11-22", "2026-11-23"]
    selection = select(tables(4, batch_date=days))
    assert sorted(selection.pool["batch_date"]) == ["2026-10-24", "2026-11-22"]
    short = select(tables(4, batch_date=days), FilterSettings(window_days=1, heldout_share=0.0))
    assert short.pool["batch_date"].tolist() == ["2026-11-22"]


def test_each_robot_of_each_site_has_its_own_limit() -> None:
    rows = tables(9, robot=["r1"] * 6 + ["r2"] * 3, site=["home"] * 3 + ["shop"] * 6)
    selection = select(rows, FilterSettings(per_robot_limit=2, heldout_share=0.0))
    assert selection.pool.groupby(["site", "robot"]).size().tolist() == [2, 2, 2]
    assert selection.pool["count"].tolist() == [59.0, 58.0, 56.0, 55.0, 53.0, 52.0]
    assert selection.funnels["negative"].over_robot_limit == 3


def test_places_that_cannot_be_trusted_are_rejected_with_their_reason() -> None:
    scenarios, environments = tables(
        6,
        is_traversable=[True, False, True, True, True, True],
        path_in_free_fraction=[1.0, 1.0, 0.89, 0.9, 1.0, 1.0],
        observed_fraction=[0.6, 0.6, 0.6, 0.25, 0.24, 0.6],
        contradicted_fraction=[None, 0.1, 0.1, 0.5, 0.1, 0.51],
    )
    scenarios = pd.concat(
        [scenarios, tables(7)[0].iloc[[6]].assign(environment_id=None)], ignore_index=True
    )
    selection = select((scenarios, environments))
    funnel = selection.funnels["negative"]
    assert sorted(selection.pool["scenario_id"]) == ["scenario-0000", "scenario-0003"]
    assert funnel.rejected == {
        "hardly_observed": 1,
        "no_environment": 1,
        "not_traversable": 1,
        "path_not_free": 1,
        "scans_disagree": 1,
    }
    assert funnel.challenging == 7
    assert funnel.usable == 2


def test_the_funnel_adds_up_under_both_counts() -> None:
    rng = np.random.default_rng(0)
    counts = rng.integers(0, 120, 300)
    rows = tables(
        300,
        negative_velocity_count=pd.array(counts, dtype="Int64"),
        not_forward_count=pd.array(counts + 40, dtype="Int64"),
        is_traversable=rng.random(300) < 0.8,
        site=[f"site {number}" for number in rng.integers(0, 6, 300)],
    )
    selection = select(rows, FilterSettings(per_robot_limit=20))
    assert set(selection.funnels) == {"negative", "not-forward"}
    for funnel in selection.funnels.values():
        assert funnel.scenarios == 300
        assert funnel.challenging == funnel.usable + sum(funnel.rejected.values())
        parts = (funnel.heldout, funnel.straddling, funnel.over_robot_limit, funnel.pool)
        assert funnel.usable == sum(parts)
        assert funnel.heldout > 0
    negative, not_forward = (selection.funnels[kind] for kind in ("negative", "not-forward"))
    assert not_forward.challenging > negative.challenging
    assert len(selection.pool) == negative.pool
    assert len(selection.heldout) >= negative.heldout


def test_the_chosen_count_decides() -> None:
    rows = tables(5, reversing_s=[0.5, 3.0, 2.5, 2.6, 0.0])
    by_seconds = FilterSettings(count_kind="reversing-seconds", threshold=2.5, heldout_share=0.0)
    selection = select(rows, by_seconds)
    assert selection.pool["scenario_id"].tolist() == ["scenario-0001", "scenario-0003"]
    assert set(selection.funnels) == {"negative", "not-forward", "reversing-seconds"}
    assert len(select(rows, FilterSettings(count_kind="not-forward", heldout_share=0)).pool) == 5


def test_held_out_places_share_nothing_with_the_pool() -> None:
    rows = tables(60, site=[f"site {number % 6}" for number in range(60)])
    selection = select(rows, FilterSettings())
    assert set(selection.pool["site"]).isdisjoint(selection.heldout["site"])
    assert set(selection.heldout["site"]) == set(selection.holdout.heldout)
    assert len(selection.pool) + len(selection.heldout) == 60


def test_held_out_are_all_usable_scenarios_of_their_places_the_hardest_first() -> None:
    rows = tables(
        80,
        site=[f"site {number % 4}" for number in range(80)],
        negative_velocity_count=pd.array(np.arange(80), dtype="Int64"),
    )
    everything = select(rows, FilterSettings())
    (site,) = everything.holdout.heldout
    assert set(everything.heldout["site"]) == {site}
    scenarios, environments = rows
    crossable = environments.loc[environments["is_traversable"] == True, "scenario_id"]  # noqa: E712  (may be NA)
    expected = scenarios[(scenarios["site"] == site) & scenarios["scenario_id"].isin(crossable)]
    assert set(everything.heldout["scenario_id"]) == set(expected["scenario_id"])
    assert everything.heldout["count"].is_monotonic_decreasing
    few = select(rows, FilterSettings(heldout_limit=3)).heldout
    assert few["scenario_id"].tolist() == everything.heldout["scenario_id"].tolist()[:3]


def test_the_sensitivity_counts_scenarios_above_each_threshold() -> None:
    counts = pd.array([0, 10, 50, 51, 300, None], dtype="Int64")
    selection = select(tables(6, negative_velocity_count=counts, not_forward_count=counts))
    sensitivity = selection.sensitivity
    assert sensitivity.thresholds.tolist() == list(range(201))
    for found in sensitivity.challenging.values():
        assert [int(found[threshold]) for threshold in (0, 9, 10, 49, 50, 51, 200)] == [
            4,
            4,
            3,
            3,
            2,
            1,
            1,
        ]


def test_no_scenarios_give_an_empty_selection() -> None:
    selection = select(tables(0))
    assert len(selection.pool) == len(selection.heldout) == 0
    assert selection.funnels["negative"].scenarios == 0
    assert selection.sensitivity.challenging["negative"].sum() == 0
    assert selection.holdout.basis == "nothing"
