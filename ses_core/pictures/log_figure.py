"""Picture of one log: scans over the path, where it was cut, and the places rebuilt from it."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from ses_core.extraction.extract import ExtractedScenario
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import Pose2D
from ses_core.pictures.figures import LIGHT, Theme, new_figure, png_bytes, style_axes
from ses_core.pictures.scenario_figure import MOST_POINTS, draw_environment, scan_points

MOST_PLACES = 12
"""Environments drawn beside the log: the hardest, in the order they were driven."""


AROUND_M = 4.0
"""What is shown around the path [m]."""


def log_figure(
    extracted: Sequence[ExtractedScenario],
    trajectories: Sequence[Trajectory],
    *,
    title: str,
    theme: Theme = LIGHT,
) -> bytes:
    """Draw a log as PNG: the whole drive with numbered cuts, beside its environments.

    Args:
        extracted: Everything extracted from the log, in order.
        trajectories: The unbroken drives of the log.
        title: What stands above the picture, for example the log's name.
        theme: Colours.
    """
    numbered = list(enumerate(extracted, start=1))
    shown = sorted(sorted(numbered, key=_hardest_first)[:MOST_PLACES], key=lambda pair: pair[0])
    columns = 2 if len(shown) <= 4 else min(4, math.ceil(len(shown) / 3))
    rows = max(2, math.ceil(len(shown) / columns))
    figure = new_figure(7.0 + 1.9 * columns, max(5.2, 2.1 * rows), theme=theme)
    left, right = figure.subfigures(
        1, 2, squeeze=False, width_ratios=(7.0, 1.9 * columns), facecolor=theme.paper
    )[0]
    drive = left.subplots()
    _draw_log(drive, numbered, shown, trajectories, theme)
    drive.set_title(title, fontsize=12, loc="left", color=theme.ink)
    places = np.ravel(right.subplots(rows, columns, squeeze=False))
    for axes in places[len(shown) :]:
        axes.axis("off")
    for axes, (number, one) in zip(places, shown, strict=False):
        draw_environment(axes, one.environment, theme=theme)
        axes.set_title(_caption(number, one), fontsize=8, loc="left", pad=7)
    if len(shown) < len(numbered):
        right.suptitle(
            f"{len(shown)} of {len(numbered)} places, the hardest", fontsize=9, color=theme.ink
        )
    return png_bytes(figure)


def _draw_log(
    axes: Axes,
    numbered: Sequence[tuple[int, ExtractedScenario]],
    shown: Sequence[tuple[int, ExtractedScenario]],
    trajectories: Sequence[Trajectory],
    theme: Theme,
) -> None:
    """Draw scan points, the paths, a dot where each scenario begins, a number on those shown."""
    style_axes(axes, theme=theme)
    axes.set_aspect("equal")
    path = np.concatenate([np.zeros((0, 2)), *(one.poses[:, :2] for one in trajectories)])
    if len(path):
        axes.set_xlim(path[:, 0].min() - AROUND_M, path[:, 0].max() + AROUND_M)
        axes.set_ylim(path[:, 1].min() - AROUND_M, path[:, 1].max() + AROUND_M)
    axes.set_xlabel("x [m]", fontsize=9)
    axes.set_ylabel("y [m]", fontsize=9)
    most = max(1, MOST_POINTS // max(1, len(trajectories)))
    for trajectory in trajectories:
        points = scan_points(trajectory, slice(None), Pose2D(0.0, 0.0), most=most)
        axes.scatter(points[:, 0], points[:, 1], s=0.8, color=theme.ink, alpha=0.25, linewidths=0)
    for trajectory in trajectories:
        axes.plot(*trajectory.poses[:, :2].T, color=theme.series[0], linewidth=1.6)
        reversing = trajectory.poses[trajectory.speed < 0.0, :2]
        axes.plot(*reversing.T, ls="", marker="x", markersize=4, color=theme.series[1])
    for _, one in numbered:
        start = one.scenario.start
        axes.plot(start.x, start.y, marker="o", markersize=4, color=_color(one, theme), zorder=4)
    for number, one in shown:
        axes.annotate(
            str(number),
            (one.scenario.start.x, one.scenario.start.y),
            color=theme.paper,
            fontsize=8,
            fontweight="bold",
            ha="center",
            va="center",
            zorder=5,
            bbox={"boxstyle": "circle,pad=0.25", "color": _color(one, theme)},
        )


def _color(one: ExtractedScenario, theme: Theme) -> str:
    return theme.series[2] if one.scenario.kind == "scenario" else theme.series[4]


def _hardest_first(pair: tuple[int, ExtractedScenario]) -> tuple[bool, bool, int, int]:
    """Rebuilt places first, scenarios before terminal segments, then by count."""
    number, one = pair
    count = one.scenario.negative_velocity_count
    return (
        one.environment is None,
        one.scenario.kind == "terminal",
        -1 if count is None else -count,
        number,
    )


def _caption(number: int, one: ExtractedScenario) -> str:
    count = one.scenario.negative_velocity_count
    counted = "count unknown" if count is None else f"{count} steps back"
    kind = "" if one.scenario.kind == "scenario" else " (rest)"
    return f"{number}{kind}: {counted}"
