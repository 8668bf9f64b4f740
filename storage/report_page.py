"""The page of one night: a single HTML file that needs nothing but itself (leaf: matplotlib)."""

from collections.abc import Callable
from pathlib import Path

from markupsafe import Markup

from ses_core.pictures.difficulty_figure import draw_difficulty
from ses_core.pictures.evaluation_figure import draw_evaluation, draw_worlds
from ses_core.pictures.figures import DARK, LIGHT, Theme
from ses_core.pictures.funnel import funnel_figure
from ses_core.pictures.learning_curve import draw_learning_curve
from ses_core.pictures.robot_figure import robot_figure
from ses_core.pictures.scorecard_figure import draw_scorecard
from ses_core.pictures.threshold_sensitivity import threshold_sensitivity_figure
from storage.durable_files import replace_file
from storage.night_report import NightReport, describe_robot, headline
from storage.page_template import load_template, themed_picture
from storage.place_gallery import gallery_script, script_digest
from storage.scorecard_section import scorecard_section

GALLERY_LIMIT = 4000
"""Most environments in a gallery, so that the page opens at once; the rest is counted."""


def write_report(path: Path, report: NightReport) -> None:
    """Write the page, whole or not at all.

    Raises:
        ArtifactError: The disk is full or failing.
    """
    replace_file(path, render_page(report).encode())


def render_page(report: NightReport) -> str:
    """Render the page; every name in it is escaped, equal reports give equal pages."""
    script = gallery_script()
    return load_template("night.html").render(
        report=report,
        headline=headline(report),
        robot_words=describe_robot(report.robot),
        pictures=_pictures(report),
        scorecard=(
            scorecard_section(report.scorecard, report.synthesis) if report.scorecard else None
        ),
        gallery_limit=GALLERY_LIMIT,
        gallery_script=script,
        gallery_script_digest=script_digest(script),
    )


def _pictures(report: NightReport) -> dict[str, Markup]:
    """Draw the figures that the night has data for, each for light and for dark pages."""
    drawings: dict[str, tuple[str, Callable[[Theme], bytes]]] = {}
    if funnel := report.funnel:
        drawings["funnel"] = (
            "; ".join(f"{step.name}: {step.count}" for step in funnel.steps),
            lambda theme: funnel_figure(
                funnel.steps,
                count_name=funnel.count_name,
                other_name=funnel.other_name,
                theme=theme,
            ),
        )
    if sensitivity := report.sensitivity:
        drawings["sensitivity"] = (
            "challenging scenarios against the threshold",
            lambda theme: threshold_sensitivity_figure(
                sensitivity.thresholds,
                sensitivity.challenging,
                threshold=sensitivity.threshold,
                scenario_count=sensitivity.scenario_count,
                theme=theme,
            ),
        )
    if report.synthesized or report.training or report.evaluation:
        drawings["robot"] = (
            f"footprint of {report.robot.name}",
            lambda theme: robot_figure(report.robot, theme=theme),
        )
    if (scorecard := report.scorecard) and scorecard.measures:
        drawings["scorecard"] = (
            "measures of real and synthesized environments",
            lambda theme: draw_scorecard(scorecard.rows, scorecard.measures, theme=theme),
        )
    if (difficulty := report.difficulty) and len(difficulty.logged):
        drawings["difficulty"] = (
            f"{difficulty.count_name}: by the log, and driven again",
            lambda theme: draw_difficulty(
                difficulty.logged,
                difficulty.simulated,
                threshold=difficulty.threshold,
                count_name=difficulty.count_name,
                theme=theme,
            ),
        )
    if report.training and (curve := report.training.curve):
        drawings["curve"] = (
            "learning curve",
            lambda theme: draw_learning_curve(curve, theme=theme),
        )
    if report.evaluation and (rows := report.evaluation.rows):
        drawings["evaluation"] = (
            "success and time by policy",
            lambda theme: draw_evaluation(rows, theme=theme),
        )
    if report.evaluation and (episodes := report.evaluation.episodes):
        drawings["worlds"] = (
            "success by held-out world",
            lambda theme: draw_worlds(episodes, theme=theme),
        )
    return {
        name: themed_picture(draw(LIGHT), draw(DARK), words)
        for name, (words, draw) in drawings.items()
    }
