"""The page of one night: a single HTML file that needs nothing but itself."""

import base64
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from ses_core.evaluation.statistics import Interval
from ses_core.pictures.figures import DARK, LIGHT
from ses_core.pictures.funnel import funnel_figure
from ses_core.pictures.gallery import thumbnail
from ses_core.pictures.threshold_sensitivity import threshold_sensitivity_figure
from storage.durable_files import replace_file
from storage.night_report import (
    Funnel,
    NightReport,
    Sensitivity,
    ShownEnvironment,
    headline,
)

GALLERY_LIMIT = 100
"""Pictures shown of each gallery, so that the page opens at once; the rest is counted."""


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
        "gallery": _gallery,
    }
    return environment.get_template("night.html").render(
        report=report,
        headline=headline(report),
        funnel_picture=_funnel_picture(report.funnel) if report.funnel else "",
        sensitivity_picture=_sensitivity_picture(report.sensitivity) if report.sensitivity else "",
        gallery_limit=GALLERY_LIMIT,
    )


def _funnel_picture(funnel: Funnel) -> Markup:
    light, dark = (
        funnel_figure(
            funnel.steps, count_name=funnel.count_name, other_name=funnel.other_name, theme=theme
        )
        for theme in (LIGHT, DARK)
    )
    words = "; ".join(f"{step.name}: {step.count}" for step in funnel.steps)
    return _picture(light, words, dark)


def _sensitivity_picture(sensitivity: Sensitivity) -> Markup:
    light, dark = (
        threshold_sensitivity_figure(
            sensitivity.thresholds,
            sensitivity.challenging,
            threshold=sensitivity.threshold,
            scenario_count=sensitivity.scenario_count,
            theme=theme,
        )
        for theme in (LIGHT, DARK)
    )
    return _picture(light, "challenging scenarios against the threshold", dark)


def _picture(png: bytes, words: str, dark: bytes | None = None) -> Markup:
    """Embed a PNG, and another one for dark pages where there is one."""
    image = Markup('<img src="{}" alt="{}" loading="lazy">').format(_data_uri(png), words)
    if dark is None:
        return Markup('<div class="sheet">{}</div>').format(image)
    return Markup(
        '<picture><source media="(prefers-color-scheme: dark)" srcset="{}">{}</picture>'
    ).format(_data_uri(dark), image)


def _gallery(environments: Sequence[ShownEnvironment]) -> Markup:
    """Embed environments as pictures of one pixel per cell, named on hovering."""
    return Markup("\n").join(
        Markup(
            '<figure class="place" title="{}"><span><img src="{}" alt="environment {}"></span>'
            "<figcaption>{}</figcaption></figure>"
        ).format(
            " · ".join(text for text in (shown.environment_id, shown.detail) if text),
            _data_uri(thumbnail(shown.cells, shown.observed)),
            shown.environment_id,
            escape(shown.caption),
        )
        for shown in environments[:GALLERY_LIMIT]
    )


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
