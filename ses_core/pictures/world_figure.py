"""Contact sheets of worlds, with their courses or start-goal pairs (leaf: matplotlib)."""

import io
import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from ses_core.geometry import Pose2D
from ses_core.navigation import NavigationTask, World
from ses_core.occupancy import OccupancyGrid

_SHEET_INCHES = 11.4
_TILE_INCHES = 1.9
_NARROWEST_TILE_INCHES = 0.8
_PAPER, _WALL, _START, _GOAL, _PAIR = "#f7f6f2", "#2f3437", "#0072b2", "#d55e00", "#009e73"
_COLOURS = ListedColormap([_PAPER, _WALL])
_FRAME = "#b9b7b0"
_BARS_M = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
_NARROWEST_INCHES = 3.2
"""Room for the heading above a single world."""

_LONGEST_SIDE = 400
"""Cells along a tile's longer side; a larger map is thinned out for the picture."""


def world_sheet(
    worlds: Sequence[World],
    *,
    tasks: Mapping[str, Sequence[NavigationTask]] | None = None,
    limit: int = 60,
) -> bytes:
    """Draw the first worlds as a PNG, each with its course or the tasks under its `world_id`."""
    shown = worlds[:limit]
    shape = float(np.median([world.grid.width_m / world.grid.height_m for world in shown]))
    tile = min(max(_TILE_INCHES * shape, _NARROWEST_TILE_INCHES), _TILE_INCHES)
    columns = min(int(_SHEET_INCHES / tile), len(shown))
    rows = math.ceil(len(shown) / columns)
    figure = Figure(
        figsize=(max(columns * tile, _NARROWEST_INCHES), rows * (_TILE_INCHES + 0.4) + 0.3),
        layout="constrained",
    )
    FigureCanvasAgg(figure)
    for index, world in enumerate(shown):
        axes = figure.add_subplot(rows, columns, index + 1)
        draw_world(axes, world)
        pairs = (tasks or {}).get(world.world_id)
        for task in pairs or ():
            _draw_pair(axes, task.start, task.goal)
        if pairs is not None and not pairs:
            _note(axes, "no pair far enough apart", place=(0.5, 0.5), align="center")
    figure.suptitle(_heading(shown, worlds, has_pairs=tasks is not None), fontsize=8)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=120)
    return buffer.getvalue()


def draw_world(axes: Axes, world: World) -> None:
    """Draw one world in metres with its name, size, free share and a scale."""
    grid = world.grid
    step = max(1, math.ceil(max(grid.cells.shape) / _LONGEST_SIDE))
    height, width = (-(-extent // step) for extent in grid.cells.shape)
    padded = np.zeros((height * step, width * step), dtype=np.bool_)
    padded[: grid.cells.shape[0], : grid.cells.shape[1]] = grid.cells
    x, y = grid.origin
    axes.imshow(
        # Occupied if any part of it is: thin walls must not vanish.
        np.asarray(padded.reshape(height, step, width, step).any(axis=(1, 3))),
        cmap=_COLOURS,
        vmin=0,
        vmax=1,
        origin="lower",
        interpolation="nearest",
        extent=(
            x,
            x + width * step * grid.resolution,
            y,
            y + height * step * grid.resolution,
        ),
    )
    axes.set_xlim(x, x + grid.width_m)
    axes.set_ylim(y, y + grid.height_m)
    if world.course is not None:
        _draw_pair(axes, *world.course)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_color(_FRAME)
        spine.set_linewidth(0.5)
    size = f"{grid.width_m:.1f} x {grid.height_m:.1f} m"
    axes.set_title(f"{_short(world.name or world.world_id)}\n{size}", fontsize=6.5, pad=3)
    _draw_scale(axes, grid)


def _draw_scale(axes: Axes, grid: OccupancyGrid) -> None:
    """Draw a bar of a round length below the map, and how much of it is free."""
    longest = max(
        (length for length in _BARS_M if length <= grid.width_m * 0.5), default=grid.width_m * 0.5
    )
    across = axes.get_xaxis_transform()
    left = grid.origin[0]
    axes.plot(
        [left, left + longest],
        [-0.02, -0.02],
        transform=across,
        color=_WALL,
        linewidth=2,
        solid_capstyle="butt",
        clip_on=False,
    )
    axes.set_xlabel(
        f"bar {longest:g} m, {np.mean(~grid.cells):.0%} free", fontsize=5.5, color=_WALL, labelpad=4
    )


def _heading(shown: Sequence[World], worlds: Sequence[World], *, has_pairs: bool) -> str:
    count = f"{len(shown)} of {len(worlds)}" if len(shown) < len(worlds) else f"{len(shown)}"
    plural = "world" if len(worlds) == 1 else "worlds"
    is_marked = has_pairs or any(world.course is not None for world in shown)
    return f"{count} {plural}" + (", from start (dot) to goal (star)" if is_marked else "")


def _note(axes: Axes, text: str, *, place: tuple[float, float], align: str) -> None:
    axes.text(
        *place,
        text,
        transform=axes.transAxes,
        horizontalalignment=align,
        fontsize=5.5,
        color=_GOAL,
        bbox={"facecolor": _PAPER, "edgecolor": "none", "pad": 1.5, "alpha": 0.9},
    )


def _draw_pair(axes: Axes, start: Pose2D, goal: tuple[float, float]) -> None:
    axes.plot([start.x, goal[0]], [start.y, goal[1]], color=_PAIR, linewidth=0.8, alpha=0.7)
    axes.plot(start.x, start.y, "o", color=_START, markersize=3.5)
    axes.plot(*goal, "*", color=_GOAL, markersize=6)


def _short(name: str) -> str:
    return name if len(name) <= 24 else f"{name[:12]}…{name[-8:]}"
