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

_SHEET_INCHES = 11.4
_TILE_INCHES = 1.9
_NARROWEST_TILE_INCHES = 0.8
_PAPER, _WALL, _START, _GOAL, _PAIR = "#f7f6f2", "#2f3437", "#0072b2", "#d55e00", "#009e73"
_COLOURS = ListedColormap([_PAPER, _WALL])
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
        figsize=(columns * tile, rows * (_TILE_INCHES + 0.25) + 0.3), layout="constrained"
    )
    FigureCanvasAgg(figure)
    for index, world in enumerate(shown):
        axes = figure.add_subplot(rows, columns, index + 1)
        draw_world(axes, world)
        for task in (tasks or {}).get(world.world_id, ()):
            _draw_pair(axes, task.start, task.goal)
    if len(shown) < len(worlds):
        figure.suptitle(f"{len(shown)} of {len(worlds)} worlds", fontsize=9)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100)
    return buffer.getvalue()


def draw_world(axes: Axes, world: World) -> None:
    """Draw one world in metres, titled with its name and size."""
    grid = world.grid
    step = max(1, math.ceil(max(grid.cells.shape) / _LONGEST_SIDE))
    height, width = (extent // step * step for extent in grid.cells.shape)
    blocks = grid.cells[:height, :width].reshape(height // step, step, width // step, step)
    x, y = grid.origin
    axes.imshow(
        np.asarray(blocks.any(axis=(1, 3))),
        cmap=_COLOURS,
        vmin=0,
        vmax=1,
        origin="lower",
        interpolation="nearest",
        extent=(x, x + width * grid.resolution, y, y + height * grid.resolution),
    )
    if world.course is not None:
        _draw_pair(axes, *world.course)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)
    size = f"{grid.width_m:.1f} x {grid.height_m:.1f} m"
    axes.set_title(f"{_short(world.name or world.world_id)}\n{size}", fontsize=6.5, pad=3)


def _draw_pair(axes: Axes, start: Pose2D, goal: tuple[float, float]) -> None:
    axes.plot([start.x, goal[0]], [start.y, goal[1]], color=_PAIR, linewidth=0.8, alpha=0.7)
    axes.plot(start.x, start.y, "o", color=_START, markersize=3.5)
    axes.plot(*goal, "*", color=_GOAL, markersize=6)


def _short(name: str) -> str:
    return name if len(name) <= 24 else f"{name[:12]}…{name[-8:]}"
