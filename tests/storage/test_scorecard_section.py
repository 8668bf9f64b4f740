from dataclasses import replace

import pytest

from ses_core.scorecard.result import Scorecard
from storage.night_report import SynthesisUse
from storage.scorecard_section import ShownRow, scorecard_section
from tests.ses_core.scorecard.samples import pillars, score
from tests.storage.nights import score_row, scorecard

SYNTHESIS = SynthesisUse(
    method_asked="gan",
    method_used="mirror",
    drawn=12,
    rejected_share=0.25,
    repeated=0,
    copied=0,
    notes=("9 environments instead of 40",),
)


def shown(found: Scorecard) -> dict[str, ShownRow]:
    groups = scorecard_section(found, None).groups
    return {row.metric: row for group in groups for row in group.rows}


def test_every_row_of_a_scorecard_is_in_one_group_and_none_is_lost() -> None:
    found = score(pillars(12, seed=0), pillars(6, seed=1))
    groups = scorecard_section(found, None).groups
    assert {group.title: len(group.rows) for group in groups} == {
        "Can they be crossed?": 2,
        "The samples as wholes": 10,
        "Copies": 6,
        "Measures": 18,
        "Drives": 6,
    }
    assert groups[0].rows[0].metric == "traversable, raw"


def test_rows_are_rounded_in_their_unit_and_marked() -> None:
    rows = shown(scorecard())
    precision = rows["precision"]
    assert (precision.value, precision.interval) == ("41.2 %", "38.0 to 45.0")
    assert (precision.real_value, precision.real_interval) == ("62.0 %", "55.0 to 70.0")
    assert (precision.aim, precision.mark) == ("high", "too low")
    assert rows["copies"].mark == ""
    assert rows["copies"].standing == "within"
    assert (rows["mean time"].value, rows["mean time"].mark) == ("31.2 s", "too high")
    silent = rows["Wasserstein-1 visibility"]
    assert (silent.value, silent.interval, silent.mark) == ("none", "", "")
    assert silent.note == "too few: n=3 real and 9 synthesized"


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (-0.00123, "squared kernel distance", "\N{MINUS SIGN}0.00123"),
        (1234.5, "count", "1,234"),
        (0.0312, "share of cells", "3.1 %"),
        (2.0, "m", "2 m"),
        (0.5, "chance", "0.5"),
    ],
)
def test_numbers_are_short(value: float, unit: str, expected: str) -> None:
    one = score_row("MMD^2", unit=unit, value=value)
    found = shown(Scorecard(rows=(one,), measures={}))
    assert found["MMD\N{SUPERSCRIPT TWO}"].value == expected


def test_the_first_thing_to_see_is_whether_they_can_be_crossed() -> None:
    tiles = scorecard_section(scorecard(), None).tiles
    assert [tile.value for tile in tiles] == ["76.3 %", "100.0 %", "62.0 %", "2 of 6"]


def test_marks_are_counted_where_they_are() -> None:
    verdict = scorecard_section(scorecard(), None).verdict
    assert verdict.startswith("2 of 6 numbers that have a ceiling are worse")
    assert '1 of 1 under "The samples as wholes"' in verdict
    assert '1 of 1 under "Drives"' in verdict
    good = Scorecard(rows=(score_row("coverage", value=0.6),), measures={})
    assert scorecard_section(good, None).verdict.startswith("All numbers that have a ceiling (1)")
    none = Scorecard(rows=(score_row("coverage", value=None),), measures={})
    assert "too few environments" in scorecard_section(none, None).verdict


def test_what_small_numbers_led_to_is_said() -> None:
    assert scorecard_section(scorecard(), SYNTHESIS).remarks == (
        "Made by mirror instead of gan.",
        "9 environments instead of 40",
        "1 of 7 rows have no value; each says why.",
    )
    one = replace(score_row("coverage", value=0.6), halves="by environment (2)")
    remarks = scorecard_section(Scorecard(rows=(one,), measures={}), None).remarks
    assert any("real-against-real values are too good" in remark for remark in remarks)
    assert any("intervals are too narrow" in remark for remark in remarks)


def test_p_values_stand_beside_their_metric() -> None:
    one = replace(score_row("MMD^2", value=0.6, note="more"), p_value=0.01, real_p_value=0.4)
    (row,) = shown(Scorecard(rows=(one,), measures={})).values()
    assert row.note == "p = 0.01, between real ones p = 0.4; more"
