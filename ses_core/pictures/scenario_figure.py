"""Picture of one scenario: what was sensed and driven, the place rebuilt from it, the figures."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from ses_core.arrays import FloatArray
from ses_core.extraction.extract import ExtractedScenario, PlaceQuality
from ses_core.extraction.reconstruction import (
    driven_path,
    scans_of,
    scenario_frame,
    sensor_poses,
)
from ses_core.extraction.scenario import Scenario
from ses_core.extraction.trajectory import Trajectory
from ses_core.geometry import Pose2D, to_frame
from ses_core.navigation import NavigationEnvironment
from ses_core.occupancy import ENVIRONMENT_SIDE_M
from ses_core.pictures.figures import LIGHT, Theme, new_figure, png_bytes, style_axes
from ses_core.robot_profile import RobotProfile
from ses_core.synthesis.traversability import shortest_path

MARGIN_M = 1.0
"""What is shown around the 5 m window [m]."""

MOST_POINTS = 60_000
"""More scan points than this are thinned out: they no longer change the picture."""


def scenario_figure(
    extracted: ExtractedScenario,
    trajectory: Trajectory,
    *,
    target: RobotProfile,
    scan_margin: float,
    theme: Theme = LIGHT,
) -> bytes:
    """Draw a scenario as PNG: scans and drive, the environment, and its columns as text.

    The goal is on top, as in the environment's cells.

    Args:
        extracted: The scenario with its place.
        trajectory: The drive it was cut from.
        target: The robot whose shortest way is drawn, with its body half-way.
        scan_margin: Scans this long [s] before and after the scenario are shown.
        theme: Colours.
    """
    figure = new_figure(12.0, 5.4, theme=theme)
    sensed, place, text = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 0.62))
    _draw_drive(figure, sensed, extracted.scenario, trajectory, scan_margin, theme)
    path = upright(driven_path(trajectory, extracted.scenario))
    draw_environment(place, extracted.environment, path, target=target, theme=theme)
    place.set_title(_place_title(extracted), fontsize=11, loc="left")
    _write_columns(text, extracted, theme)
    return png_bytes(figure)


def upright(points: FloatArray) -> FloatArray:
    """Turn points (N, 2) [m] of a scenario's frame so that its goal is on top of the picture."""
    return np.column_stack((-points[:, 1], points[:, 0]))


def scan_points(
    trajectory: Trajectory, chosen: slice, frame: Pose2D, *, most: int = MOST_POINTS
) -> FloatArray:
    """Give where beams ended, (N, 2) [m] in a frame, evenly thinned out to at most `most`."""
    if trajectory.scans is None or trajectory.scan_poses is None:
        return np.zeros((0, 2))
    ranges = trajectory.scans.ranges[chosen].astype(np.float64)
    poses = sensor_poses(trajectory.scans, trajectory.scan_poses[chosen], frame)
    directions = poses[:, 2:3] + trajectory.scans.angles
    is_return = (ranges > 0.0) & (ranges <= trajectory.scans.range_max)
    # Where nothing returned the range may be infinite, and infinity times 0 is undefined.
    ranges = np.where(is_return, ranges, 0.0)
    x = (poses[:, :1] + ranges * np.cos(directions))[is_return]
    y = (poses[:, 1:2] + ranges * np.sin(directions))[is_return]
    every = max(1, math.ceil(len(x) / most))
    return np.column_stack((x[::every], y[::every]))


def draw_environment(
    axes: Axes,
    environment: NavigationEnvironment | None,
    path: FloatArray | None = None,
    *,
    target: RobotProfile | None = None,
    theme: Theme = LIGHT,
) -> None:
    """Draw an environment's cells, unseen ones shaded, with start, goal and ways through it.

    Args:
        axes: Where to draw.
        environment: The place, or None where it could not be rebuilt.
        path: The way driven (P, 2) [m], upright.
        target: The robot whose shortest way is drawn too, with its body half-way.
        theme: Colours.
    """
    half = ENVIRONMENT_SIDE_M / 2
    style_axes(axes, theme=theme)
    axes.grid(visible=False)
    axes.set_aspect("equal")
    axes.set_xlim(-half, half)
    axes.set_ylim(0.0, ENVIRONMENT_SIDE_M)
    axes.set_xticks([])
    axes.set_yticks([])
    if environment is None:
        axes.text(0.0, half, "no place rebuilt", ha="center", va="center", color=theme.ink)
        return
    values = np.where(environment.cells, 2, np.where(environment.observed, 0, 1))
    axes.imshow(
        values,
        cmap=ListedColormap([theme.free, theme.unknown, theme.occupied]),
        vmin=0,
        vmax=2,
        extent=(-half, half, 0.0, ENVIRONMENT_SIDE_M),
        interpolation="nearest",
    )
    if path is not None:
        axes.plot(*path.T, color=theme.series[0], linewidth=1.6, label="driven")
    if target is not None:
        shortest = shortest_path(environment.cells, target.inscribed_radius_m)
        if shortest is not None:
            label = f"shortest ({target.name})"
            line = upright(shortest)
            axes.plot(*line.T, color=theme.series[1], linewidth=1.4, ls="--", label=label)
            axes.add_patch(_body_on_the_way(target, line, theme))
        axes.legend(
            loc="upper center",
            bbox_to_anchor=(0.5, -0.03),
            ncols=2,
            fontsize=8,
            frameon=False,
            labelcolor=theme.ink,
        )
    _mark_ends(axes, theme)


def _body_on_the_way(target: RobotProfile, line: FloatArray, theme: Theme) -> Polygon:
    """Give a robot's bare body half-way along a line (N, 2) [m], turned along it."""
    pieces = np.diff(line, axis=0)
    lengths = np.hypot(pieces[:, 0], pieces[:, 1])
    made = np.cumsum(lengths)
    number = int(np.searchsorted(made, made[-1] / 2))
    ahead = pieces[number] / lengths[number]
    middle = line[number + 1] - (made[number] - made[-1] / 2) * ahead
    turn = np.array([ahead, (-ahead[1], ahead[0])])
    corners = middle + np.array(target.body()) @ turn
    return Polygon(corners, fc=(*to_rgb(theme.series[1]), 0.25), ec=theme.series[1], lw=1.2)


def _draw_drive(
    figure: Figure,
    axes: Axes,
    scenario: Scenario,
    trajectory: Trajectory,
    scan_margin: float,
    theme: Theme,
) -> None:
    """Draw scan points, the drive coloured by speed, and the window that is rebuilt."""
    frame = scenario_frame(scenario)
    half = ENVIRONMENT_SIDE_M / 2
    style_axes(axes, theme=theme)
    axes.set_aspect("equal")
    axes.set_xlim(-half - MARGIN_M, half + MARGIN_M)
    axes.set_ylim(-MARGIN_M, ENVIRONMENT_SIDE_M + MARGIN_M)
    axes.set_xlabel("to the right of the start [m]", fontsize=9)
    axes.set_ylabel("towards the goal [m]", fontsize=9)
    axes.set_title("scans and drive", fontsize=11, loc="left")
    chosen = scans_of(trajectory, scenario, margin=scan_margin)
    points = upright(scan_points(trajectory, chosen, frame))
    axes.scatter(points[:, 0], points[:, 1], s=1.0, color=theme.ink, alpha=0.35, linewidths=0)
    axes.add_patch(
        Rectangle((-half, 0.0), 2 * half, 2 * half, fill=False, ec=theme.series[5], lw=1.2)
    )
    first = scenario.first_step - trajectory.first_step
    last = scenario.last_step - trajectory.first_step
    path = upright(to_frame(trajectory.poses[first : last + 1, :2], frame))
    speed = trajectory.speed[first + 1 : last + 1]
    pieces = np.stack((path[:-1], path[1:]), axis=1)
    forward = LineCollection(list(pieces), cmap="viridis", linewidths=2.6, capstyle="round")
    forward.set_array(np.ma.masked_invalid(speed))
    forward.set_clim(0.0, _fastest(speed))
    axes.add_collection(forward)
    is_reversing = speed < 0.0
    if is_reversing.any():
        axes.plot(
            *path[1:][is_reversing].T,
            ls="",
            marker="x",
            markersize=5,
            color=theme.series[1],
            label="reversing",
        )
    bar = figure.colorbar(forward, ax=axes, shrink=0.75, pad=0.02)
    bar.set_label("speed [m/s]", color=theme.ink, fontsize=9)
    bar.ax.tick_params(colors=theme.ink, labelsize=8)
    _mark_ends(axes, theme)
    if is_reversing.any():
        axes.legend(loc="upper right", fontsize=8, facecolor=theme.paper, labelcolor=theme.ink)


def _fastest(speed: FloatArray) -> float:
    """Give the top of the colour scale [m/s], unmoved by single outliers."""
    known = speed[~np.isnan(speed)]
    return max(0.1, float(np.percentile(known, 98.0))) if len(known) else 0.1


def _mark_ends(axes: Axes, theme: Theme) -> None:
    """Mark start (circle) and goal (star)."""
    axes.plot(0.0, 0.0, marker="o", markersize=9, color=theme.series[2], clip_on=False, zorder=5)
    axes.plot(
        0.0,
        ENVIRONMENT_SIDE_M,
        marker="*",
        markersize=13,
        color=theme.series[4],
        clip_on=False,
        zorder=5,
    )


def _place_title(extracted: ExtractedScenario) -> str:
    if extracted.environment is None:
        return "environment"
    return f"environment from {extracted.environment.origin}, 30 x 30"


def _write_columns(axes: Axes, extracted: ExtractedScenario, theme: Theme) -> None:
    """Write the scenario's columns beside the pictures."""
    axes.axis("off")
    rows = scenario_rows(extracted.scenario) + quality_rows(extracted.quality)
    axes.text(
        0.0, 1.0, extracted.scenario_id, fontsize=11, fontweight="bold", color=theme.ink, va="top"
    )
    for index, (name, value) in enumerate(rows):
        height = 0.92 - 0.056 * index
        axes.text(0.0, height, name, fontsize=9, color=theme.ink, alpha=0.75, va="top")
        axes.text(1.0, height, value, fontsize=9, color=theme.ink, ha="right", va="top")


def scenario_rows(scenario: Scenario) -> list[tuple[str, str]]:
    """Give a scenario's columns as names and values for people."""
    kind = f"terminal, {scenario.outcome}" if scenario.kind == "terminal" else scenario.kind
    return [
        ("kind", kind),
        ("steps", f"{scenario.first_step} to {scenario.last_step}"),
        ("duration", _measured(scenario.duration_s, "s", digits=1)),
        ("way driven", _measured(scenario.arc_length_m, "m", digits=1)),
        ("steps with v < 0", _counted(scenario.negative_velocity_count)),
        ("steps not forward", _counted(scenario.not_forward_count)),
        ("reversing", _measured(scenario.reversing_s, "s", digits=1)),
    ]


def quality_rows(quality: PlaceQuality | None) -> list[tuple[str, str]]:
    """Give the quality and difficulty of a place as names and values for people."""
    if quality is None:
        return [("place", "not rebuilt")]
    rows = [
        ("cells observed", f"{quality.observed_fraction:.0%}"),
        ("path in free cells", f"{quality.path_in_free_fraction:.0%}"),
        ("cells corrected", str(quality.overridden_cells)),
        ("can be crossed", "yes" if quality.is_traversable else "no"),
    ]
    if quality.contradicted_fraction is not None:
        rows.insert(2, ("scans disagree", f"{quality.contradicted_fraction:.0%}"))
    if quality.difficulty is not None:
        measures = quality.difficulty
        rows += [
            ("closest obstacle", _measured(measures.closest_obstacle, "m")),
            ("visibility", _measured(measures.visibility, "m")),
            ("dispersion", f"{measures.dispersion:.2f}"),
            ("narrowest width", _measured(measures.characteristic_dimension, "m")),
            ("tortuosity", f"{measures.tortuosity:.2f}"),
        ]
    return rows


def _measured(value: float | None, unit: str, *, digits: int = 2) -> str:
    return "unknown" if value is None or math.isnan(value) else f"{value:.{digits}f} {unit}"


def _counted(value: int | None) -> str:
    return "unknown" if value is None else str(value)
