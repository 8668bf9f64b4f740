"""The two maps of an episode: the world with the path, and what the robot saw at one moment."""

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon
from matplotlib.transforms import Affine2D

from ses_core.arrays import Float32Array, FloatArray
from ses_core.evaluation.episode_trace import EpisodeMoment, EpisodeTrace, stretches
from ses_core.geometry import Pose2D, compose, from_frame, inverse
from ses_core.occupancy import OccupancyGrid
from ses_core.pictures.figures import Theme, style_axes

NEAR_M = 2.9
"""What is shown around the robot, to each side [m]: about as far as it marks obstacles."""

_BLUE, _VERMILION, _GREEN, _PURPLE, _AMBER, _SKY = range(6)  # places in a theme's series
_INSCRIBED, _LETHAL = 253.0, 254.0
_BODY_ALPHA = 0.5


def draw_world(
    axes: Axes, trace: EpisodeTrace, moment: EpisodeMoment, *, window: FloatArray, theme: Theme
) -> None:
    """Draw the true world with the path coloured by speed, reversing marked, start and goal.

    Args:
        axes: Where to draw.
        trace: The whole episode.
        moment: The robot is drawn where it was then.
        window: Corners (2, 2) [m] of what is shown.
        theme: Colours.
    """
    _style_map(axes, theme.occupied, theme)
    _draw_walls(axes, trace.drive.trial.place.task.world.grid, theme.occupied, theme)
    _mark_course(axes, trace, theme)
    _mark_reversing(axes, trace, theme)
    path, speed = trace.poses[:, :2], np.abs(trace.velocities[1:, 0])
    pieces = np.stack((path[:-1], path[1:]), axis=1)
    lines = LineCollection(list(pieces), cmap="viridis", linewidths=2.6, capstyle="round", zorder=4)
    lines.set_array(speed)
    lines.set_clim(0.0, max(0.1, float(speed.max())))
    axes.add_collection(lines)
    _draw_bodies(axes, trace, moment, theme)
    axes.set_title("where it went", fontsize=11, loc="left", color=theme.ink)
    _crop(axes, window)
    bar = axes.figure.colorbar(lines, ax=axes, location="bottom", shrink=0.7, aspect=40, pad=0.02)
    bar.set_label("measured speed [m/s]", color=theme.ink, fontsize=9)
    bar.ax.tick_params(colors=theme.ink, labelsize=8)


def draw_view(axes: Axes, trace: EpisodeTrace, moment: EpisodeMoment, *, theme: Theme) -> None:
    """Draw what the robot saw and planned at a moment, over the true walls, and explain it all."""
    _style_map(axes, theme.unknown, theme)
    _draw_walls(axes, trace.drive.trial.place.task.world.grid, theme.unknown, theme)
    _draw_costmap(axes, moment, theme)
    _mark_course(axes, trace, theme)
    _mark_reversing(axes, trace, theme)
    is_past = trace.times <= moment.time + 1e-6
    for part, style in ((is_past, "-"), (~is_past, ":")):
        axes.plot(*trace.poses[part, :2].T, color=theme.ink, lw=1.3, ls=style, zorder=4)
    plan = from_frame(moment.plan, _map_frame(moment))
    axes.plot(*plan.T, color=theme.series[_BLUE], linewidth=2.2, zorder=5)
    points = from_frame(moment.scan, moment.pose)
    axes.scatter(
        points[:, 0], points[:, 1], s=6.0, color=theme.series[_GREEN], linewidths=0, zorder=6
    )
    _draw_bodies(axes, trace, moment, theme)
    axes.set_title(
        f"what it saw and planned at {moment.time:.1f} s", fontsize=11, loc="left", color=theme.ink
    )
    here = np.array([moment.pose.x, moment.pose.y])
    _crop(axes, np.array([here - NEAR_M, here + NEAR_M]))
    axes.legend(
        handles=_key(trace, theme),
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        borderaxespad=0.0,
        fontsize=8.5,
        frameon=False,
        labelcolor=theme.ink,
    )


def _map_frame(moment: EpisodeMoment) -> Pose2D:
    """Give the frame of costmap and plan in the world: the robot is where it takes itself to be."""
    return compose(moment.pose, inverse(moment.believed))


def _style_map(axes: Axes, outside: str, theme: Theme) -> None:
    """Prepare a map; what lies outside the world counts as wall."""
    style_axes(axes, theme=theme)
    axes.grid(visible=False)
    axes.set_facecolor(outside)
    axes.set_xlabel("x [m]", fontsize=9)
    axes.set_ylabel("y [m]", fontsize=9)


def _crop(axes: Axes, window: FloatArray) -> None:
    """Show the window with corners (2, 2) [m], whatever has been drawn."""
    axes.set_aspect("equal")
    axes.set_xlim(window[0, 0], window[1, 0])
    axes.set_ylim(window[0, 1], window[1, 1])


def _draw_walls(axes: Axes, grid: OccupancyGrid, color: str, theme: Theme) -> None:
    x, y = grid.origin
    axes.imshow(
        grid.cells.astype(np.float64),
        cmap=LinearSegmentedColormap.from_list("walls", [theme.free, color]),
        vmin=0.0,
        vmax=1.0,
        origin="lower",
        extent=(x, x + grid.width_m, y, y + grid.height_m),
    )


def _draw_costmap(axes: Axes, moment: EpisodeMoment, theme: Theme) -> None:
    """Tint what is inflated, and what is marked as occupied."""
    frame = _map_frame(moment)
    height, width = moment.costs.shape
    x, y = moment.origin
    image = axes.imshow(
        _tinted(moment.costs, theme),
        origin="lower",
        interpolation="nearest",
        extent=(x, x + width * moment.resolution, y, y + height * moment.resolution),
        zorder=2,
    )
    turned = Affine2D().rotate(frame.yaw).translate(frame.x, frame.y)
    image.set_transform(turned + axes.transData)


def _tinted(costs: Float32Array, theme: Theme) -> FloatArray:
    """Give colours (H, W, 4) of costs (H, W), free ones transparent."""
    colors = np.zeros((*costs.shape, 4))
    colors[..., :3] = to_rgb(theme.series[_SKY])
    colors[..., 3] = 0.1 + 0.5 * costs / _INSCRIBED
    colors[costs == 0.0, 3] = 0.0
    colors[costs == _INSCRIBED, 3] = 0.75
    colors[costs == _LETHAL] = (*to_rgb(theme.series[_PURPLE]), 1.0)
    return colors


def _mark_course(axes: Axes, trace: EpisodeTrace, theme: Theme) -> None:
    """Mark the start, and the goal with the circle that counts as reached."""
    task = trace.drive.trial.place.task
    radius = trace.drive.simulation.success_radius_m
    color = theme.series[_AMBER]
    axes.add_patch(Circle(task.goal, radius, facecolor=color, alpha=0.15, zorder=3))
    axes.add_patch(Circle(task.goal, radius, fill=False, edgecolor=color, lw=1.4, zorder=3))
    axes.plot(*task.goal, marker="*", markersize=13, color=color, zorder=5)
    start = theme.series[_GREEN]
    axes.plot(task.start.x, task.start.y, marker="o", markersize=8, color=start, zorder=5)


def _mark_reversing(axes: Axes, trace: EpisodeTrace, theme: Theme) -> None:
    """Draw a broad band wherever the robot reversed: also a short way can be seen."""
    path = trace.poses[:, :2]
    bands = [path[first - 1 : end] for first, end in stretches(trace.is_reversing)]
    color = theme.series[_VERMILION]
    axes.add_collection(
        LineCollection(bands, colors=color, linewidths=8.0, capstyle="round", alpha=0.75, zorder=3)
    )


def _draw_bodies(axes: Axes, trace: EpisodeTrace, moment: EpisodeMoment, theme: Theme) -> None:
    """Draw the robot where it ended and at the moment, with a line from its centre to its front.

    Their outlines lie over everything, what fills them below the path.
    """
    corners = np.array(trace.drive.profile.body())
    front = np.array([[0.0, 0.0], [corners[:, 0].max(), 0.0]])
    end = Pose2D(*trace.poses[-1].tolist())
    for pose, face in ((end, _end_color(trace, theme)), (moment.pose, theme.paper)):
        body = from_frame(corners, pose)
        axes.add_patch(Polygon(body, fc=face, ec="none", alpha=_BODY_ALPHA, zorder=2.5))
        axes.add_patch(Polygon(body, fill=False, ec=theme.ink, lw=1.3, zorder=7))
        axes.plot(*from_frame(front, pose).T, color=theme.ink, lw=1.3, zorder=7)


def _end_color(trace: EpisodeTrace, theme: Theme) -> str:
    return theme.series[_GREEN if trace.episode.outcome == "success" else _VERMILION]


def _key(trace: EpisodeTrace, theme: Theme) -> list[Artist]:
    """Explain what is drawn."""
    ink, sky = theme.ink, theme.series[_SKY]
    radius = trace.drive.simulation.success_radius_m
    return [
        _dot("o", theme.series[_GREEN], "start"),
        _dot("*", theme.series[_AMBER], f"goal, {radius:g} m"),
        Patch(facecolor=theme.paper, edgecolor=ink, label="robot at this moment"),
        Patch(
            facecolor=_end_color(trace, theme),
            edgecolor=ink,
            alpha=_BODY_ALPHA,
            label="robot at the end",
        ),
        Line2D([], [], color=theme.series[_VERMILION], lw=6, alpha=0.75, label="reversing"),
        Line2D([], [], color=theme.series[_BLUE], lw=2.2, label="global plan"),
        Line2D([], [], color=ink, lw=1.3, label="path before"),
        Line2D([], [], color=ink, lw=1.3, ls=":", label="path after"),
        _dot(".", theme.series[_GREEN], "scan"),
        Patch(facecolor=theme.series[_PURPLE], label="costmap: lethal"),
        Patch(facecolor=sky, alpha=0.75, label="costmap: inscribed"),
        Patch(facecolor=sky, alpha=0.3, label="costmap: inflated"),
        Patch(facecolor=theme.unknown, label="true wall"),
    ]


def _dot(marker: str, color: str, label: str) -> Line2D:
    return Line2D([], [], ls="", marker=marker, markersize=7, color=color, label=label)
