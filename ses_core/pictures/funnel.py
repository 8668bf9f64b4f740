"""The funnel of a night as bars (leaf: matplotlib)."""

from collections.abc import Sequence

from ses_core.extraction.funnel import FunnelStep
from ses_core.pictures.figures import LIGHT, Theme, new_axes, new_figure, png_bytes


def funnel_figure(
    steps: Sequence[FunnelStep], *, count_name: str, other_name: str, theme: Theme = LIGHT
) -> bytes:
    """Draw the steps from top to bottom as bars, a second bar where the other count stands."""
    figure = new_figure(7.2, 0.85 + 0.46 * len(steps), theme=theme)
    axes = new_axes(figure, theme=theme)
    widest = max([1, *(step.count for step in steps), *(step.other or 0 for step in steps)])
    for row, step in enumerate(steps):
        bars = [(step.count, theme.series[0])]
        if step.other is not None:
            bars.append((step.other, theme.series[4]))
        height = 0.66 / len(bars)
        for number, (count, color) in enumerate(bars):
            y = row + (number - (len(bars) - 1) / 2) * height
            axes.barh(y, count, height=height * 0.92, color=color)
            axes.text(count + 0.012 * widest, y, f"{count:,}", color=theme.ink, va="center", size=9)
    if any(step.other is not None for step in steps):
        axes.barh(0, 0, color=theme.series[0], label=f"by {count_name}")
        axes.barh(0, 0, color=theme.series[4], label=f"by {other_name}")
        figure.legend(
            loc="outside lower center", ncols=2, frameon=False, labelcolor=theme.ink, fontsize=9
        )
    axes.set_yticks(range(len(steps)), [step.name for step in steps])
    axes.set_ylim(len(steps) - 0.5, -0.5)
    axes.set_xlim(0, widest * 1.12)
    axes.grid(visible=False)
    axes.xaxis.set_visible(False)
    axes.spines["bottom"].set_visible(False)
    axes.tick_params(axis="y", length=0, labelsize=10)
    return png_bytes(figure)
