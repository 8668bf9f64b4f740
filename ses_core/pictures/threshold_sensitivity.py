"""How many scenarios are challenging, whatever the threshold had been (leaf: matplotlib)."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from ses_core.arrays import FloatArray, IntArray
from ses_core.pictures.figures import LIGHT, Theme, new_axes, new_figure, png_bytes


def threshold_sensitivity_figure(
    thresholds: FloatArray,
    challenging: Mapping[str, IntArray],
    *,
    threshold: float | None,
    scenario_count: int,
    theme: Theme = LIGHT,
) -> bytes:
    """Draw challenging scenarios against the threshold, one line for each kind of count.

    Args:
        thresholds: (T,) counts that a scenario has to exceed.
        challenging: By kind of count, (T,) scenarios above each threshold.
        threshold: The one in force, marked; None where a share was chosen instead.
        scenario_count: All scenarios, for the axis of shares.
        theme: Colours.
    """
    figure = new_figure(7.2, 3.0, theme=theme)
    axes = new_axes(figure, theme=theme)
    for (name, counts), color, style in zip(
        challenging.items(),
        (theme.series[0], theme.series[4], theme.series[2]),
        ("-", "--", ":"),
        strict=False,
    ):
        axes.step(
            thresholds, counts, where="post", color=color, linestyle=style, linewidth=2, label=name
        )
    if threshold is not None:
        _mark(axes, threshold, theme=theme)
    axes.set_xlabel("count that a scenario has to exceed")
    axes.set_ylabel("challenging scenarios")
    axes.set_xlim(float(thresholds[0]), float(thresholds[-1]))
    highest = max(int(counts.max()) for counts in challenging.values())
    axes.set_ylim(0.0, max(1.0, 1.05 * highest))
    if scenario_count > 0:
        shares = axes.secondary_yaxis(
            "right",
            functions=(
                lambda count: np.asarray(count, dtype=np.float64) * (100.0 / scenario_count),
                lambda share: np.asarray(share, dtype=np.float64) * (scenario_count / 100.0),
            ),
        )
        shares.set_ylabel("share [%]", color=theme.ink)
        shares.tick_params(colors=theme.ink, labelsize=9)
        shares.spines["right"].set_color(theme.faint)
    axes.legend(frameon=False, labelcolor=theme.ink, fontsize=9, loc="upper right")
    return png_bytes(figure)


def _mark(axes: Axes, threshold: float, *, theme: Theme) -> None:
    axes.axvline(threshold, color=theme.series[1], linewidth=1.2)
    mark = axes.annotate(
        f"threshold {threshold:g}",
        (threshold, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(4, -2),
        textcoords="offset points",
        color=theme.ink,
        size=9,
        va="top",
        annotation_clip=True,
    )
    # A threshold beyond the axis would else squeeze the figure to reach its label.
    mark.set_in_layout(False)
