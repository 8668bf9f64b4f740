"""Picture of one episode: where it went, what the robot saw at one moment, and all over time."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from ses_core.arrays import FloatArray
from ses_core.evaluation.episode_trace import EpisodeMoment, EpisodeTrace
from ses_core.pictures.episode_maps import draw_view, draw_world
from ses_core.pictures.episode_timeline import draw_timeline
from ses_core.pictures.figures import LIGHT, Theme, new_figure, png_bytes

AROUND_M = 2.0
"""What is shown of a world around path, start and goal [m]."""

ENDINGS = {
    "success": "reached the goal",
    "collision": "collided",
    "timeout": "ran out of time",
    "stuck": "got stuck",
}

_TALL = 0.8  # a world narrower than this share of its height gets a column of its own
_NARROWEST, _WIDEST = 0.3, 1.5  # width over height of the panel of the world


def episode_figure(trace: EpisodeTrace, moment: EpisodeMoment, *, theme: Theme = LIGHT) -> bytes:
    """Draw an episode as PNG: the world, the robot's view at a moment, and all over time.

    Args:
        trace: The whole episode.
        moment: What the robot saw and planned then; this moment is marked everywhere.
        theme: Colours.
    """
    panels = _panels(trace, theme)
    _write_title(panels.figure, trace, theme)
    draw_world(panels.world, trace, moment, window=panels.window, theme=theme)
    draw_view(panels.view, trace, moment, theme=theme)
    draw_timeline(panels.timeline, trace, moment=moment.time, theme=theme)
    return png_bytes(panels.figure)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Panels:
    """Where to draw: two maps, the part (2, 2) [m] of the world that is shown, and the timeline."""

    figure: Figure
    world: Axes
    window: FloatArray
    view: Axes
    timeline: SubFigure


def _panels(trace: EpisodeTrace, theme: Theme) -> _Panels:
    """Lay the panels out: a tall world beside everything else, a wide one above the timeline."""
    width, height = np.ptp(_extent(trace), axis=0)
    if width < _TALL * height:
        shape = max(_NARROWEST, float(width / height))
        figure = new_figure(8.8 + 9.6 * shape, 10.9, theme=theme)
        world, right = _beside(figure, (0.8 + 9.6 * shape, 8.0), theme)
        view, timeline = _stacked(right, (5.6, 4.6), theme)
    else:
        shape = min(_WIDEST, max(1.0, float(width / height)))
        figure = new_figure(8.4 + 5.4 * shape, 10.9, theme=theme)
        maps, timeline = _stacked(figure, (6.2, 4.4), theme)
        world, view = _beside(maps, (0.9 + 5.2 * shape, 7.5), theme)
    return _Panels(
        figure=figure,
        world=world.subplots(),
        window=_window(trace, shape),
        view=view.subplots(),
        timeline=timeline,
    )


def _beside(
    figure: Figure | SubFigure, widths: tuple[float, float], theme: Theme
) -> list[SubFigure]:
    return list(
        figure.subfigures(1, 2, squeeze=False, width_ratios=widths, facecolor=theme.paper)[0]
    )


def _stacked(
    figure: Figure | SubFigure, heights: tuple[float, float], theme: Theme
) -> list[SubFigure]:
    return list(
        figure.subfigures(2, 1, squeeze=False, height_ratios=heights, facecolor=theme.paper)[:, 0]
    )


def _extent(trace: EpisodeTrace) -> FloatArray:
    """Give the corners (2, 2) [m] around all that happened, within the world."""
    lower, upper = _world_corners(trace)
    points = np.vstack((trace.poses[:, :2], trace.drive.trial.place.task.goal))
    return np.clip([points.min(axis=0) - AROUND_M, points.max(axis=0) + AROUND_M], lower, upper)


def _window(trace: EpisodeTrace, shape: float) -> FloatArray:
    """Widen what must be seen to a panel of that width over height, as far as the world goes."""
    lower, upper = _world_corners(trace)
    extent = _extent(trace)
    width, height = np.ptp(extent, axis=0)
    size = np.minimum([max(width, height * shape), max(height, width / shape)], upper - lower)
    first = np.clip(extent.mean(axis=0) - size / 2.0, lower, upper - size)
    return np.array([first, first + size])


def _world_corners(trace: EpisodeTrace) -> FloatArray:
    grid = trace.drive.trial.place.task.world.grid
    return np.add(grid.origin, [(0.0, 0.0), (grid.width_m, grid.height_m)])


def _write_title(figure: Figure, trace: EpisodeTrace, theme: Theme) -> None:
    """Say how it ended, and which episode this is."""
    episode, world = trace.episode, trace.drive.trial.place.task.world
    figure.suptitle(
        f"{episode.policy} {ENDINGS[episode.outcome]} after {episode.time_s:.1f} s\n"
        f"{world.name or world.world_id}, pair {episode.pair}, trial {episode.trial}",
        x=0.012,
        ha="left",
        fontsize=13,
        fontweight="bold",
        color=theme.ink,
    )
    figure.text(
        0.988,
        0.99,
        f"drove {episode.path_length_m:.1f} m, {trace.reversing_s:.1f} s of it "
        f"reversing, stood {trace.standing_s:.1f} s\n"
        f"shortest way at 2 m/s {episode.optimal_time_s:.1f} s, "
        f"simulator {episode.simulator}, seed {episode.seed}",
        ha="right",
        va="top",
        fontsize=9,
        linespacing=1.6,
        color=theme.ink,
    )
