"""The page of a scorecard by hand: the section of the night's page, and what was compared."""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from ses_core.navigation import NavigationDomain
from ses_core.pictures.figures import DARK, LIGHT
from ses_core.pictures.gallery import contact_sheet
from ses_core.pictures.scorecard_figure import draw_scorecard
from ses_core.scorecard.result import Scorecard
from storage.night_report import SynthesisUse
from storage.page_template import load_template, themed_picture
from storage.scorecard_section import scorecard_section

SHEET_LIMIT = 60
"""Most environments on a contact sheet, so that a page can be sent around."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScorecardPage:
    """What the page shows; the names are those of folders."""

    real_name: str
    synthesized_name: str
    robot: str
    scorecard: Scorecard
    synthesis: SynthesisUse | None
    real: NavigationDomain
    synthesized: NavigationDomain


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """A contact sheet and what to say of it."""

    title: str
    words: str
    picture: Markup


def render_scorecard_page(page: ScorecardPage) -> str:
    """Render the page; every name in it is escaped, equal scorecards give equal pages."""
    chart, scorecard = {}, page.scorecard
    if scorecard.measures:
        light, dark = (
            draw_scorecard(scorecard.rows, scorecard.measures, theme=theme)
            for theme in (LIGHT, DARK)
        )
        chart["chart"] = themed_picture(
            light, dark, "measures of real and synthesized environments"
        )
    sheets = (_sheet("Real", page.real), _sheet("Synthesized", page.synthesized))
    return load_template("scorecard_page.html").render(
        page=page,
        section=scorecard_section(scorecard, page.synthesis),
        sheets=[sheet for sheet in sheets if sheet is not None],
        **chart,
    )


def _sheet(title: str, domain: NavigationDomain) -> Sheet | None:
    """Draw environments spread evenly over all of them; None where there are none."""
    count = len(domain.environments)
    if not count:
        return None
    chosen = np.unique(np.linspace(0, count - 1, min(count, SHEET_LIMIT)).round().astype(int))
    shown = [domain.environments[number] for number in chosen]
    cells = np.stack([one.cells for one in shown])
    observed = np.stack([one.observed for one in shown])
    light, dark = (contact_sheet(cells, observed, theme=theme) for theme in (LIGHT, DARK))
    return Sheet(
        title=f"{title} environments",
        words="" if len(shown) == count else f"; {len(shown)} of {count:,}, evenly spread",
        picture=themed_picture(light, dark, f"{len(shown)} {title.lower()} environments"),
    )
