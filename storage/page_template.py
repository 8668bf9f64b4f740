"""How every page is made: escaped templates, pictures inside the page, numbers in words."""

import base64
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup

from ses_core.evaluation.statistics import Interval
from storage.place_gallery import gallery_data


def load_template(name: str) -> Template:
    """Load a page's template; everything put into it is escaped, what it lacks is an error."""
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
    return environment.get_template(name)


def themed_picture(light: bytes, dark: bytes, words: str) -> Markup:
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
