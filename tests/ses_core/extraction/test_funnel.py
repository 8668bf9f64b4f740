from dataclasses import replace

import pandas as pd
import pytest

from ses_core.extraction.funnel import challenging_rule, funnel_remarks, funnel_steps
from ses_core.extraction.holdout import Holdout
from ses_core.extraction.selection import FilterFunnel
from ses_core.settings import FilterSettings

FUNNEL = FilterFunnel(
    terminal=3,
    scenarios=1200,
    unknown=0,
    challenging=90,
    rejected={"no_environment": 0, "not_traversable": 12},
    usable=78,
    heldout=14,
    straddling=0,
    over_robot_limit=0,
    pool=64,
)
SITES = Holdout(basis="site", heldout=("home-3",), sides=pd.Series(dtype=str))


def test_only_levels_that_depend_on_the_count_carry_the_other_one() -> None:
    other = replace(FUNNEL, challenging=200, usable=170, pool=130)
    steps = funnel_steps(FUNNEL, other, logs=4, synthesized=100)
    assert [(step.count, step.other) for step in steps] == [
        (4, None),
        (1200, None),
        (90, 200),
        (78, 170),
        (64, 130),
        (100, None),
    ]


def test_remarks_name_what_went_where_and_pass_over_zeros() -> None:
    assert funnel_remarks(FUNNEL, SITES) == (
        "3: unfinished rests of drives stand apart and are not scenarios.",
        "12: challenging scenarios cannot be crossed by the target robot as rebuilt.",
        "14: usable ones are held out for evaluation.",
        "Held out for evaluation: 1 sites.",
    )


def test_one_place_alone_is_said_to_hold_nothing_out() -> None:
    nothing = replace(SITES, basis="nothing", heldout=())
    assert funnel_remarks(FUNNEL, nothing)[-1].startswith("Nothing is held out")


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (FilterSettings(), "more than 50 steps with v < 0"),
        (
            FilterSettings(count_kind="not-forward", challenging_share=0.23),
            "the 23 % with the most steps with v ≤ 0.05 m/s",
        ),
        (
            FilterSettings(count_kind="reversing-seconds", threshold=2.5),
            "more than 2.5 seconds of reversing",
        ),
    ],
)
def test_rule_is_said_in_words(settings: FilterSettings, words: str) -> None:
    assert challenging_rule(settings) == words
