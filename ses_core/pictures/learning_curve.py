"""The learning curve of a training: success rate and time of success (leaf: matplotlib)."""

from collections.abc import Sequence

from ses_core.learning.training_curve import CurvePoint
from ses_core.pictures.figures import LIGHT, Theme, new_figure, png_bytes, style_axes


def draw_learning_curve(curve: Sequence[CurvePoint], *, theme: Theme = LIGHT) -> bytes:
    """Draw what training episodes were like, as PNG.

    Raises:
        ValueError: The curve has no point.
    """
    if not curve:
        raise ValueError("learning curve has 0 points, expected at least 1")
    figure = new_figure(8.0, 3.0, theme=theme)
    success, time = figure.subplots(1, 2)
    steps = [point.steps for point in curve]
    marker = "o" if len(curve) < 10 else None
    success.plot(
        steps,
        [100.0 * point.success_rate for point in curve],
        marker=marker,
        color=theme.series[0],
        label="success",
    )
    success.plot(
        steps,
        [100.0 * point.collision_rate for point in curve],
        marker=marker,
        color=theme.series[1],
        label="collision",
    )
    success.set_ylim(0.0, 100.0)
    success.set_ylabel("training episodes [%]")
    success.legend(frameon=False, fontsize=9, labelcolor=theme.ink)
    timed = [(point.steps, point.mean_time_s) for point in curve if point.mean_time_s is not None]
    time.plot(
        [step for step, _ in timed],
        [seconds for _, seconds in timed],
        marker=marker,
        color=theme.series[2],
    )
    time.set_ylim(bottom=0.0)
    time.set_ylabel("mean time of successes [s]")
    for axes in (success, time):
        style_axes(axes, theme=theme)
        axes.set_xlabel("decisions")
        axes.set_xlim(0, steps[-1])
    return png_bytes(figure)
