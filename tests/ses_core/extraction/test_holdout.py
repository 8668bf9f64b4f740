"""Whole sites are held out, or places; never a scenario by itself."""

import pandas as pd
from hypothesis import given
from hypothesis import strategies as st

from ses_core.extraction.holdout import choose_heldout, hold_out

names = st.sets(st.text(min_size=1, max_size=12), max_size=40)


def drives(*rows: tuple[str, str, float, float]) -> pd.DataFrame:
    """Make scenarios from (site, log, x at the start, x at the goal)."""
    return pd.DataFrame(
        {
            "site": [row[0] for row in rows],
            "log_id": [row[1] for row in rows],
            "start_x_m": [row[2] for row in rows],
            "start_y_m": [0.0] * len(rows),
            "goal_x_m": [row[3] for row in rows],
            "goal_y_m": [0.0] * len(rows),
        }
    )


@given(names, st.floats(0.01, 0.99))
def test_two_or_more_places_leave_neither_side_empty(places: set[str], share: float) -> None:
    heldout = choose_heldout(places, share=share)
    assert heldout <= places
    if len(places) >= 2:
        assert 0 < len(heldout) < len(places)
    else:
        assert not heldout


@given(names, st.floats(0.01, 0.5))
def test_a_new_place_moves_at_most_one_other_each_way(places: set[str], share: float) -> None:
    if len(places) < 2:
        return
    before = choose_heldout(places, share=share)
    after = choose_heldout(places | {"a new site"}, share=share)
    # The lowest no longer has to be held out, the highest no longer has to be kept back.
    assert len((after & places) - before) <= 1
    assert len(before - after) <= 1


def test_about_the_share_is_held_out() -> None:
    places = [f"site {number}" for number in range(1000)]
    assert 200 < len(choose_heldout(places, share=0.25)) < 300
    assert choose_heldout(places, share=0.0) == frozenset()


def test_sites_are_held_out_whole() -> None:
    rows = drives(*((f"site {n % 5}", f"log {n}", 0.0, 5.0) for n in range(40)))
    holdout = hold_out(rows, share=0.25, map_logs=())
    assert holdout.basis == "site"
    assert set(rows.loc[holdout.sides == "heldout", "site"]) == set(holdout.heldout)
    assert set(rows.loc[holdout.sides == "training", "site"]).isdisjoint(holdout.heldout)


def test_in_one_site_logs_are_held_out_whole() -> None:
    rows = drives(*(("home", f"log {n % 8}", 40.0 * n, 40.0 * n + 5.0) for n in range(40)))
    holdout = hold_out(rows, share=0.25, map_logs=())
    assert holdout.basis == "place"
    assert set(holdout.sides) == {"training", "heldout"}
    assert rows.assign(side=holdout.sides).groupby("log_id")["side"].nunique().max() == 1


def test_in_one_mapped_site_the_same_place_of_two_logs_is_on_one_side() -> None:
    xs = [1.0, 16.0, 31.0, 46.0, 61.0, 76.0]
    rows = drives(*(("home", log, x, x + 5.0) for log in ("monday", "tuesday") for x in xs))
    holdout = hold_out(rows, share=0.3, map_logs=["monday", "tuesday"])
    assert holdout.basis == "place"
    by_place = rows.assign(side=holdout.sides).groupby("start_x_m")["side"]
    assert by_place.nunique().max() == 1
    assert set(holdout.sides) == {"training", "heldout"}


def test_a_drive_between_a_held_out_tile_and_another_is_on_neither_side() -> None:
    rows = drives(
        ("home", "log", 1.0, 6.0), ("home", "log", 12.0, 17.0), ("home", "log", 20.0, 25.0)
    )
    holdout = hold_out(rows, share=0.3, map_logs=["log"])
    assert holdout.sides[1] == "straddling"
    assert {holdout.sides[0], holdout.sides[2]} == {"training", "heldout"}


def test_with_one_place_nothing_is_held_out() -> None:
    holdout = hold_out(drives(("home", "log", 0.0, 5.0)), share=0.25, map_logs=())
    assert holdout.basis == "nothing"
    assert holdout.heldout == ()
    assert holdout.sides.tolist() == ["training"]
