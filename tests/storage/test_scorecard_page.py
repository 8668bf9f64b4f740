import io
import re
from dataclasses import replace

import pytest
from PIL import Image

from ses_core.navigation import NavigationDomain
from storage.night_report import SynthesisUse
from storage.scorecard_page import SHEET_LIMIT, ScorecardPage, render_scorecard_page
from tests.ses_core.scorecard.samples import pillars
from tests.ses_core.synthesis.places import domain_of
from tests.storage.nights import score_row, scorecard
from tests.storage.pages import Page, plain

HOSTILE = "\"><script>x()</script><img src=//evil>'&"


def hostile_page() -> ScorecardPage:
    """Make a page with hostile text wherever somebody else's text gets."""
    row = replace(score_row(HOSTILE, value=None, note=HOSTILE), feature=HOSTILE)
    return ScorecardPage(
        real_name=HOSTILE,
        synthesized_name=HOSTILE,
        robot=HOSTILE,
        scorecard=replace(scorecard(), rows=(*scorecard().rows, row)),
        synthesis=SynthesisUse(
            method_asked=HOSTILE,
            method_used="rs",
            drawn=4,
            rejected_share=0.0,
            repeated=0,
            copied=0,
            notes=(HOSTILE,),
        ),
        real=domain_of(pillars(SHEET_LIMIT + 3, seed=0)),
        synthesized=domain_of(pillars(7, seed=1)),
    )


@pytest.fixture(scope="module")
def html() -> str:
    return render_scorecard_page(hostile_page())


def test_what_others_wrote_is_text_and_never_markup(html: str) -> None:
    page = Page(html)
    assert page.scripts == []
    assert page.text.count(HOSTILE) >= 7
    assert "<script" not in html


def test_the_page_needs_nothing_but_itself(html: str) -> None:
    for _, attributes in Page(html).tags:
        for name in ("src", "href", "srcset"):
            if name in attributes:
                assert str(attributes[name]).startswith("data:")
    assert "url(" not in html
    assert "@import" not in html
    assert len(html) < 1_000_000


def test_it_holds_the_table_the_figure_and_both_sheets(html: str) -> None:
    page = Page(html)
    assert len([tag for tag, attributes in page.tags if attributes.get("class") == "group"]) == 5
    images = [Image.open(io.BytesIO(content)) for content in page.images()]
    figure, real, synthesized = images
    assert figure.size[0] > 1000
    assert real.size[1] > 3 * synthesized.size[1]
    text = plain(page)
    assert f"{SHEET_LIMIT} of {SHEET_LIMIT + 3}, evenly spread" in text
    assert "2 of 6 numbers that have a ceiling are worse" in text


def test_equal_scorecards_give_equal_pages(html: str) -> None:
    assert render_scorecard_page(hostile_page()) == html


def test_without_environments_or_measures_there_are_no_pictures() -> None:
    nothing = replace(
        hostile_page(),
        scorecard=replace(scorecard(), measures={}),
        real=NavigationDomain(()),
        synthesized=NavigationDomain(()),
    )
    assert not re.findall("<img", render_scorecard_page(nothing))
