"""Environments as pictures: packed for a page to draw, or on a contact sheet (leaf: matplotlib)."""

import math
from collections.abc import Sequence

import numpy as np

from ses_core.arrays import BoolArray, ByteArray
from ses_core.occupancy import ENVIRONMENT_CELLS
from ses_core.pictures.figures import LIGHT, Theme, new_figure, png_bytes

PIXELS_PER_CELL = 4
GAP_PIXELS = 14
CAPTION_PIXELS = 20

FREE, OCCUPIED, UNKNOWN = 0, 1, 2


def packed_places(cells: BoolArray, observed: BoolArray) -> bytes:
    """Pack environments (N, 30, 30) for a page that draws them itself.

    226 bytes each: the cells, then what was observed; row-major from the goal edge, the first
    cell in the highest bit, each of the two filled up to whole bytes.
    """
    planes = np.stack((cells, observed), axis=1).reshape(2 * len(cells), ENVIRONMENT_CELLS**2)
    return np.packbits(planes, axis=1).tobytes()


def contact_sheet(
    cells: BoolArray,
    observed: BoolArray,
    *,
    captions: Sequence[str] = (),
    title: str = "",
    columns: int = 10,
    theme: Theme = LIGHT,
) -> bytes:
    """Draw environments (N, 30, 30) in rows, goal on top, as one PNG.

    A dot at the bottom marks the start, a ring at the top the goal.

    Raises:
        ValueError: There is no environment, or not one caption for each.
    """
    if len(cells) == 0:
        raise ValueError("found no environment to draw, expected at least 1")
    if captions and len(captions) != len(cells):
        raise ValueError(f"found {len(captions)} captions, expected {len(cells)}")
    columns = min(columns, len(cells))
    rows = math.ceil(len(cells) / columns)
    side = ENVIRONMENT_CELLS * PIXELS_PER_CELL
    pitch_x = side + GAP_PIXELS
    pitch_y = side + GAP_PIXELS + (CAPTION_PIXELS if captions else 0)
    top = 2 * CAPTION_PIXELS if title else GAP_PIXELS
    width, height = columns * pitch_x + GAP_PIXELS, top + rows * pitch_y + GAP_PIXELS // 2

    palette = np.array(
        [_rgb(theme.free), _rgb(theme.occupied), _rgb(theme.unknown)], dtype=np.uint8
    )
    sheet = np.full((height, width, 3), _rgb(theme.paper), dtype=np.uint8)
    corners = [
        (top + pitch_y * (index // columns), GAP_PIXELS + pitch_x * (index % columns))
        for index in range(len(cells))
    ]
    for (y, x), place, seen in zip(corners, cells, observed, strict=True):
        kinds = _kinds(place, seen).repeat(PIXELS_PER_CELL, axis=0).repeat(PIXELS_PER_CELL, axis=1)
        sheet[y : y + side, x : x + side] = palette[kinds]

    dots_per_inch = 100
    figure = new_figure(width / dots_per_inch, height / dots_per_inch, theme=theme)
    figure.set_layout_engine("none")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(sheet, interpolation="nearest", extent=(0, width, height, 0))
    axes.set_axis_off()
    middles = [x + side / 2 for _, x in corners]
    axes.scatter(
        middles, [y + side for y, _ in corners], s=22, color=theme.series[1], zorder=3, linewidths=0
    )
    axes.scatter(
        middles,
        [y for y, _ in corners],
        s=24,
        facecolors=theme.paper,
        edgecolors=theme.series[1],
        linewidths=1.4,
        zorder=3,
    )
    for middle, (y, _), caption in zip(middles, corners, captions, strict=False):
        axes.text(middle, y + side + 7, caption, color=theme.ink, size=7, ha="center", va="top")
    if title:
        axes.text(GAP_PIXELS, CAPTION_PIXELS * 0.9, title, color=theme.ink, size=10, va="center")
    axes.set_xlim(0, width)
    axes.set_ylim(height, 0)
    return png_bytes(figure, dots_per_inch=dots_per_inch)


def _kinds(cells: BoolArray, observed: BoolArray) -> ByteArray:
    kinds = np.where(observed, np.uint8(FREE), np.uint8(UNKNOWN))
    kinds[cells] = OCCUPIED
    return kinds


def _rgb(color: str) -> list[int]:
    return list(bytes.fromhex(color.removeprefix("#")))
