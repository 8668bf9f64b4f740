"""What all figures share: a theme for light and for dark pages, axes, and PNG bytes.

Colours are Okabe and Ito's, which stay apart for colour-blind eyes. Figures are built with
matplotlib's objects only: no `pyplot`, so nothing global changes and threads do not collide.
"""

import io
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Okabe and Ito: blue, vermilion, green, purple, orange, sky."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Theme:
    """Colours of paper and ink, and of the cells of an environment."""

    paper: str
    ink: str
    faint: str
    free: str
    occupied: str
    unknown: str
    series: tuple[str, ...] = COLORS


LIGHT = Theme(
    paper="#ffffff",
    ink="#1d232b",
    faint="#d5dae1",
    free="#f7f8fa",
    occupied="#2b3442",
    unknown="#dfe3e9",
)

DARK = Theme(
    paper="#171b22",
    ink="#e4e8ee",
    faint="#39414d",
    free="#262c36",
    occupied="#c3cddb",
    unknown="#39414d",
    series=("#56B4E9", "#E69F00", "#2FBF92", "#CC79A7", "#D55E00", "#0072B2"),
)


def new_figure(width: float, height: float, *, theme: Theme = LIGHT) -> Figure:
    """Open a figure of width x height [inch] on the theme's paper."""
    figure = Figure(figsize=(width, height), layout="constrained", facecolor=theme.paper)
    FigureCanvasAgg(figure)
    return figure


def new_axes(figure: Figure, *, theme: Theme = LIGHT) -> Axes:
    """Add the figure's only axes, styled."""
    axes = figure.add_subplot()
    style_axes(axes, theme=theme)
    return axes


def style_axes(axes: Axes, *, theme: Theme = LIGHT) -> None:
    """Give axes the common look: open at top and right, faint lines, the theme's ink."""
    axes.set_facecolor(theme.paper)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("bottom", "left"):
        axes.spines[side].set_color(theme.faint)
    axes.tick_params(colors=theme.ink, labelsize=9)
    axes.xaxis.label.set_color(theme.ink)
    axes.yaxis.label.set_color(theme.ink)
    axes.title.set_color(theme.ink)
    axes.grid(visible=True, color=theme.faint, linewidth=0.6)
    axes.set_axisbelow(True)


def png_bytes(figure: Figure, *, dots_per_inch: int = 110) -> bytes:
    """Draw a figure; equal figures give equal bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dots_per_inch, metadata={"Software": None})
    return buffer.getvalue()
