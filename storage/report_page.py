"""The page of one night: a single HTML file that needs nothing but itself (leaf: matplotlib)."""

import base64
from collections.abc import Callable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from ses_core.evaluation.statistics import Interval
from ses_core.pictures.evaluation_figure import draw_evaluation, draw_worlds
from ses_core.pictures.figures import DARK, LIGHT, Theme
from ses_core.pictures.funnel import funnel_figure
from ses_core.pictures.learning_curve import draw_learning_curve
from ses_core.pictures.robot_figure import robot_figure
from ses_core.pictures.threshold_sensitivity import threshold_sensitivity_figure
from storage.durable_files import replace_file
from storage.night_report import NightReport, describe_robot, headline
from storage.place_gallery import gallery_data, gallery_script, script_digest

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
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "percent": _percent,
        "percent_interval": _percent_interval,
        "points": _points,
        "points_interval": _points_interval,
        "seconds": _seconds,
        "seconds_interval": _seconds_interval,
        "signed_seconds": _signed_seconds,
        "signed_seconds_interval": _signed_seconds_interval,
        "duration": _duration,
        "thousands": _thousands,
        "picture": _picture,
        "gallery_data": gallery_data,
    }
    script = gallery_script()
    return environment.get_template("night.html").render(
        report=report,
        headline=headline(report),
        robot_words=describe_robot(report.robot),
        pictures=_pictures(report),
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
        name: _themed_picture(draw(LIGHT), draw(DARK), words)
        for name, (words, draw) in drawings.items()
    }


def _themed_picture(light: bytes, dark: bytes, words: str) -> Markup:
    """Embed a PNG for light pages and its twin for dark ones."""
    return Markup(
        '<div class="chart"><picture>'
        '<source media="(prefers-color-scheme: dark)" srcset="{}"><img src="{}" alt="{}">'
        "</picture></div>"
    ).format(_data_uri(dark), _data_uri(light), words)


def _picture(png: bytes, words: str) -> Markup:
    """Embed a PNG drawn on white."""
    return Markup('<div class="sheet"><img src="{}" alt="{}"></div>').format(_data_uri(png), words)


def _data_uri(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def _percent_interval(interval: Interval | None) -> str:
    return "" if interval is None else f"{100.0 * interval[0]:.0f} to {100.0 * interval[1]:.0f}"


def _points(difference: float) -> str:
    return f"{_signed(100.0 * difference)} points"


def _points_interval(interval: Interval | None) -> str:
    if interval is None:
        return "no interval"
    return f"{_signed(100.0 * interval[0])} to {_signed(100.0 * interval[1])}"


def _seconds(value: float | None) -> str:
    return "none" if value is None else f"{value:.1f} s"


def _seconds_interval(interval: Interval | None) -> str:
    return "" if interval is None else f"{interval[0]:.1f} to {interval[1]:.1f}"


def _signed_seconds(value: float) -> str:
    return f"{_signed(value)} s"


def _signed_seconds_interval(interval: Interval | None) -> str:
    if interval is None:
        return "no interval"
    return f"{_signed(interval[0])} to {_signed(interval[1])}"


def _signed(value: float) -> str:
    return f"{value:+.1f}".replace("-", "\N{MINUS SIGN}")


def _duration(seconds: float) -> str:
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {rest:02d} s"


def _thousands(number: int) -> str:
    return f"{number:,}"
