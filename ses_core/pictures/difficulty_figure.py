"""Logged against simulated counts of the same places."""

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.pictures.figures import LIGHT, Theme, new_axes, new_figure, png_bytes

_LINEAR_TO = 10.0
"""Counts up to here are spaced evenly, larger ones by their logarithm: many are 0."""

_TICKS = (0, 5, 10, 20, 50, 100, 200, 500, 1000, 2000)


def draw_difficulty(
    logged: FloatArray,
    simulated: FloatArray,
    *,
    threshold: float,
    count_name: str,
    theme: Theme = LIGHT,
) -> bytes:
    """Draw one dot per place (N,), and the threshold for both counts, as PNG."""
    figure = new_figure(5.2, 4.2, theme=theme)
    axes = new_axes(figure, theme=theme)
    most = 1.2 * max(float(np.max(logged)), float(np.max(simulated)), _LINEAR_TO)
    axes.set_xscale("symlog", linthresh=_LINEAR_TO)
    axes.set_yscale("symlog", linthresh=_LINEAR_TO)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_ticks([tick for tick in _TICKS if tick <= most])
        axis.set_major_formatter("{x:g}")
        axis.set_ticks([], minor=True)
    if threshold > 0.0:
        axes.axvline(threshold, color=theme.series[1], lw=1.0, ls="--")
        axes.axhline(threshold, color=theme.series[1], lw=1.0, ls="--")
    axes.plot((0.0, most), (0.0, most), color=theme.faint, lw=1.2)
    axes.plot(logged, simulated, "o", color=theme.series[0], ms=5, alpha=0.6, mew=0)
    axes.set_xlim(-1.0, most)
    axes.set_ylim(-1.0, most)
    axes.set_xlabel(f"{count_name}, in the log")
    axes.set_ylabel(f"{count_name}, driven again")
    return png_bytes(figure)
