"""A scorecard as a picture: distributions beside each other, distances beside the real band."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ses_core.arrays import FloatArray
from ses_core.pictures.figures import LIGHT, Theme, new_figure, png_bytes, style_axes
from ses_core.scorecard.result import Measured
from ses_core.scorecard.rows import ScorecardRow

_ACROSS = 5
_STEPS = 24
_NO_SPREAD = 1e-6
"""Values this near to each other are one value."""


def draw_scorecard(
    rows: Sequence[ScorecardRow], measures: Mapping[str, Measured], *, theme: Theme = LIGHT
) -> bytes:
    """Draw distances over real-against-real, then every measure's distributions, as PNG.

    Raises:
        ValueError: There is no measure.
    """
    if not measures:
        raise ValueError("scorecard has 0 measures, expected at least 1")
    down = -(-(len(measures) + 1) // _ACROSS)
    figure = new_figure(2.8 * _ACROSS, 2.5 * down, theme=theme)
    cells = figure.subplots(down, _ACROSS, squeeze=False).ravel()
    # Its long labels need room on the left, which only the first column has to itself.
    style_axes(cells[0], theme=theme)
    _ratios(cells[0], rows, theme=theme)
    for axes, (name, measured) in zip(cells[1:], measures.items(), strict=False):
        style_axes(axes, theme=theme)
        _distribution(axes, name, measured, theme=theme)
    for axes in cells[len(measures) + 1 :]:
        axes.set_axis_off()
    figure.legend(
        handles=[
            Line2D([], [], color=theme.series[number], lw=1.6, label=label)
            for number, label in enumerate(("real", "synthesized"))
        ],
        loc="outside upper left",
        frameon=False,
        fontsize=9,
        labelcolor=theme.ink,
        ncols=2,
    )
    return png_bytes(figure)


def _distribution(axes: Axes, name: str, measured: Measured, *, theme: Theme) -> None:
    """Draw what share of each side falls into steps of the same width."""
    real, synthesized = _finite(measured.real), _finite(measured.synthesized)
    axes.set_title(f"{name} ({len(real)} / {len(synthesized)})", fontsize=9)
    axes.set_xlabel(measured.unit)
    both = np.concatenate((real, synthesized))
    if len(both) == 0:
        axes.text(0.5, 0.5, "too few", ha="center", color=theme.ink, transform=axes.transAxes)
        return
    low, high = float(both.min()), float(both.max())
    if high - low < _NO_SPREAD:
        low, high = low - 0.5, high + 0.5
    edges = np.linspace(low, high, _STEPS + 1)
    for values, color in zip((real, synthesized), theme.series, strict=False):
        if len(values):
            shares = np.histogram(values, edges)[0] / len(values)
            axes.stairs(shares, edges, color=color, lw=1.6)
    axes.set_yticks([])


def _ratios(axes: Axes, rows: Sequence[ScorecardRow], *, theme: Theme) -> None:
    """Draw distances of distributions over the middle real-against-real one, with that one's band.

    Distances whose real-against-real value is 0 have no ratio and are left out.
    """
    shown = [
        row
        for row in rows
        if row.metric.startswith("Wasserstein-1 ") and row.value is not None and row.real_value
    ]
    axes.set_title("distance / real-against-real", fontsize=9)
    for line, row in enumerate(shown):
        scale = row.real_value or 1.0
        band = ((row.real_low or 0.0) / scale, (row.real_high or 0.0) / scale)
        axes.plot(band, (line, line), color=theme.series[0], lw=6, alpha=0.35)
        axes.plot((row.value or 0.0) / scale, line, "o", color=theme.series[1], ms=5)
    axes.axvline(1.0, color=theme.series[0], lw=1.0)
    if not shown:
        axes.text(0.5, 0.5, "too few", ha="center", color=theme.ink, transform=axes.transAxes)
        return
    axes.set_yticks(
        range(len(shown)), [row.metric.removeprefix("Wasserstein-1 ") for row in shown], fontsize=7
    )
    axes.set_ylim(len(shown) - 0.5, -0.5)


def _finite(values: FloatArray) -> FloatArray:
    return values[np.isfinite(values)]
