"""The costmap a scan builds: marks, clearing, distances and inflated costs (costmap_2d).

One map per robot holds all it has seen, at 0.05 m, unknown counting as free; the local costmap is
a 10 x 10 m window of it. Local and global costmap of the Jackal see the same scans through the
same layers, so they are one map here. Sources: costmap_2d's obstacle and inflation layers,
jackal_navigation's costmap parameters.
"""

import math

import numpy as np

from ses_core.arrays import ByteArray, Float32Array, FloatArray
from ses_core.compilation import compiled
from ses_core.simulation.robot import RobotModel
from ses_core.simulation.state import Memory, Scratch, Slot

RESOLUTION_M = 0.05
"""Cell size of the costmap [m]."""

OBSTACLE_RANGE_M = 2.5
"""Hits beyond this are not marked [m]."""

RAYTRACE_RANGE_M = 3.0
"""Beams clear marks up to here [m]."""

COST_SCALING_FACTOR = 10.0
LETHAL = 254.0
INSCRIBED = 253.0

FAR = 255
"""`Memory.distances` at 16 cells (0.8 m) or more from every mark."""

FAR_CELLS = 16

MARGIN_M = 0.5
"""The map reaches this far beyond the world, where nothing is ever seen: a robot that does not
know the place does not know its borders either."""

WINDOW_CELLS = 200
WINDOW_SIZE = WINDOW_CELLS + 2
"""Edge of the local costmap with a border of one cell that no search crosses."""

_HALF_WINDOW = WINDOW_CELLS // 2
_SEEN_NOW = 2  # flag on a mark while one scan is worked in


@compiled
def inflation_costs(costs: Float32Array, inflation_radius: float, inscribed_radius: float) -> None:
    """Fill the cost (256,) of each squared distance [cells^2] to the nearest obstacle.

    As costmap_2d: nothing beyond the inflation radius, not even the inscribed cost.
    """
    for squared in range(256):
        distance = RESOLUTION_M * math.sqrt(squared)
        if squared == 0:
            costs[squared] = LETHAL
        elif squared == FAR or distance > inflation_radius:
            costs[squared] = 0.0
        elif distance <= inscribed_radius:
            costs[squared] = INSCRIBED
        else:
            costs[squared] = math.floor(
                (INSCRIBED - 1.0) * math.exp(-COST_SCALING_FACTOR * (distance - inscribed_radius))
            )


@compiled
def work_in_scan(
    slot: Slot,
    memory: Memory,
    ranges: Float32Array,
    robot: RobotModel,
    clears_footprint: bool,
) -> None:
    """Mark hits, clear what beams pass through and what the robot stands on.

    A beam without a return neither marks nor clears. Only net changes count as changes: a mark
    that this scan would clear and set again was never gone.

    Args:
        clears_footprint: costmap_2d's `footprint_clearing_enabled`.
    """
    cosine, sine = math.cos(slot.yaw), math.sin(slot.yaw)
    laser_x = slot.x + cosine * robot.mount_x - sine * robot.mount_y
    laser_y = slot.y + sine * robot.mount_x + cosine * robot.mount_y
    laser_yaw = slot.yaw + robot.mount_yaw
    from_column = (laser_x - slot.map_x) / RESOLUTION_M
    from_row = (laser_y - slot.map_y) / RESOLUTION_M
    reach = OBSTACLE_RANGE_M / RESOLUTION_M
    hits = 0
    for beam in range(ranges.shape[0]):
        cells = ranges[beam] / RESOLUTION_M
        if cells >= reach:
            continue
        angle = laser_yaw + robot.beam_angles[beam]
        index = _map_index(
            slot, from_column + cells * math.cos(angle), from_row + cells * math.sin(angle)
        )
        if index >= 0:
            memory.marks[index] |= _SEEN_NOW
            hits += 1
    for beam in range(ranges.shape[0]):
        if ranges[beam] < np.inf:
            _clear_along(
                slot,
                memory,
                from_column,
                from_row,
                laser_yaw + robot.beam_angles[beam],
                min(ranges[beam], RAYTRACE_RANGE_M) / RESOLUTION_M,
            )
    if clears_footprint:
        _clear_footprint(slot, memory, robot)
    if hits > 0:
        _settle_marks(slot, memory, from_column, from_row)


@compiled
def _map_index(slot: Slot, column: float, row: float) -> int:
    """Give the flat index of the map cell that holds a point [cells], or -1 outside the map."""
    if not (0.0 <= column < slot.map_width and 0.0 <= row < slot.map_height):
        return -1
    return slot.map_offset + int(row) * slot.map_width + int(column)


@compiled
def _clear_along(
    slot: Slot, memory: Memory, column: float, row: float, angle: float, length: float
) -> None:
    """Clear the marks on one beam, its last cell included, leaping where none are near.

    A step goes one cell along the faster axis, at most sqrt(2) cells; a cell whose nearest
    mark is d cells away lets the walk skip what is nearer, less 3/4 of a cell of rounding.
    """
    along_x, along_y = math.cos(angle), math.sin(angle)
    pace = max(abs(along_x), abs(along_y))
    along_x, along_y = along_x / pace, along_y / pace
    steps = int(length * pace)
    step = 0
    while step <= steps:
        index = _map_index(slot, column + step * along_x, row + step * along_y)
        if index < 0:
            return
        if memory.marks[index] == 1:
            memory.marks[index] = 0
            _note_change(slot, index)
        near = math.sqrt(float(memory.distances[index]))
        step += max(1, int((near - 0.75) / 1.4143))


@compiled
def _clear_footprint(slot: Slot, memory: Memory, robot: RobotModel) -> None:
    """Forget the marks inside the padded footprint."""
    cosine, sine = math.cos(slot.yaw), math.sin(slot.yaw)
    column = int((slot.x - slot.map_x) / RESOLUTION_M)
    row = int((slot.y - slot.map_y) / RESOLUTION_M)
    reach = int(robot.circumscribed_radius / RESOLUTION_M) + 1
    for cell_row in range(max(row - reach, 0), min(row + reach + 1, slot.map_height)):
        for cell_column in range(max(column - reach, 0), min(column + reach + 1, slot.map_width)):
            index = slot.map_offset + cell_row * slot.map_width + cell_column
            if memory.marks[index] == 0:
                continue
            away_x = slot.map_x + (cell_column + 0.5) * RESOLUTION_M - slot.x
            away_y = slot.map_y + (cell_row + 0.5) * RESOLUTION_M - slot.y
            if is_inside(
                robot.footprint_sides,
                cosine * away_x + sine * away_y,
                cosine * away_y - sine * away_x,
            ):
                if memory.marks[index] & 1:
                    _note_change(slot, index)
                memory.marks[index] = 0


@compiled
def is_inside(sides: FloatArray, x: float, y: float) -> bool:
    """Tell whether a point [m] in the robot's frame lies in a convex polygon (E, 3)."""
    for k in range(sides.shape[0]):
        if sides[k, 0] * x + sides[k, 1] * y > sides[k, 2]:
            return False
    return True


@compiled
def _settle_marks(slot: Slot, memory: Memory, column: float, row: float) -> None:
    """Turn the cells flagged by this scan into marks."""
    reach = int(OBSTACLE_RANGE_M / RESOLUTION_M) + 2
    first_row, last_row = max(int(row) - reach, 0), min(int(row) + reach, slot.map_height - 1)
    first = max(int(column) - reach, 0)
    last = min(int(column) + reach, slot.map_width - 1)
    for cell_row in range(first_row, last_row + 1):
        start = slot.map_offset + cell_row * slot.map_width
        for index in range(start + first, start + last + 1):
            if memory.marks[index] >= _SEEN_NOW:
                if memory.marks[index] == _SEEN_NOW:
                    _note_change(slot, index)
                memory.marks[index] = 1


@compiled
def _note_change(slot: Slot, index: int) -> None:
    cell = index - slot.map_offset
    row = cell // slot.map_width
    column = cell - row * slot.map_width
    slot.changed_left = min(slot.changed_left, column)
    slot.changed_right = max(slot.changed_right, column)
    slot.changed_bottom = min(slot.changed_bottom, row)
    slot.changed_top = max(slot.changed_top, row)


@compiled
def forget_changes(slot: Slot) -> None:
    """Declare every distance up to date."""
    slot.changed_left, slot.changed_right = slot.map_width, -1
    slot.changed_bottom, slot.changed_top = slot.map_height, -1


@compiled
def refresh_distances(slot: Slot, memory: Memory, scratch: Scratch, worker: int) -> None:
    """Bring the squared distances to the nearest mark up to date around changed marks; exact.

    Separable (Meijster et al. 2000) and cut off at 16 cells: first along columns, then the
    lower envelope along rows.
    """
    if slot.changed_right < 0:
        return
    width, height = slot.map_width, slot.map_height
    left = max(slot.changed_left - FAR_CELLS + 1, 0)
    right = min(slot.changed_right + FAR_CELLS, width)
    bottom = max(slot.changed_bottom - FAR_CELLS + 1, 0)
    top = min(slot.changed_top + FAR_CELLS, height)
    # Squared distances along columns, with 16 cells to either side of the changed ones.
    columns = scratch.columns[worker]
    first, last = max(left - FAR_CELLS, 0), min(right + FAR_CELLS, width)
    shift = FAR_CELLS - left  # column c of the map lies at c + shift
    span = right - left
    beyond = FAR_CELLS * FAR_CELLS
    columns[: top - bottom, : span + 2 * FAR_CELLS] = beyond
    run = columns[columns.shape[0] - 1]
    run[: span + 2 * FAR_CELLS] = FAR_CELLS
    for row in range(max(bottom - FAR_CELLS, 0), top):
        marks = memory.marks[slot.map_offset + row * width : slot.map_offset + (row + 1) * width]
        for column in range(first, last):
            place = column + shift
            run[place] = 0 if marks[column] else min(run[place] + 1, FAR_CELLS)
        if row >= bottom:
            for place in range(first + shift, last + shift):
                columns[row - bottom, place] = run[place] * run[place]
    run[: span + 2 * FAR_CELLS] = FAR_CELLS
    for row in range(min(top + FAR_CELLS, height) - 1, bottom - 1, -1):
        marks = memory.marks[slot.map_offset + row * width : slot.map_offset + (row + 1) * width]
        for column in range(first, last):
            place = column + shift
            run[place] = 0 if marks[column] else min(run[place] + 1, FAR_CELLS)
        if row < top:
            line = columns[row - bottom]
            for place in range(first + shift, last + shift):
                line[place] = min(line[place], run[place] * run[place])
    for row in range(bottom, top):
        start = slot.map_offset + row * width + left
        _lower_envelope(memory.distances[start : start + span], columns[row - bottom], run[:span])
    forget_changes(slot)


@compiled
def _lower_envelope(distances: ByteArray, line: np.ndarray, best: np.ndarray) -> None:  # type: ignore[type-arg]  # int16 rows; numba specialises by itself
    """Combine squared distances along columns over the 31 columns around each cell."""
    span = distances.shape[0]
    for cell in range(span):
        best[cell] = line[cell + FAR_CELLS]
    for away in range(1, FAR_CELLS):
        squared = np.int16(away * away)
        before, after = line[FAR_CELLS - away :], line[FAR_CELLS + away :]
        for cell in range(span):
            best[cell] = min(best[cell], min(before[cell], after[cell]) + squared)
    for cell in range(span):
        distances[cell] = min(best[cell], FAR)


@compiled
def centre_window(slot: Slot, memory: Memory, number: int) -> None:
    """Copy the 10 x 10 m around the robot into the slot's window; beyond the map is lethal."""
    slot.window_column = int((slot.x - slot.map_x) / RESOLUTION_M) - _HALF_WINDOW
    slot.window_row = int((slot.y - slot.map_y) / RESOLUTION_M) - _HALF_WINDOW
    window = memory.window_distances[number]
    window[:] = 0
    first_row, last_row = (
        max(slot.window_row, 0),
        min(slot.window_row + WINDOW_CELLS, slot.map_height),
    )
    first = max(slot.window_column, 0)
    last = min(slot.window_column + WINDOW_CELLS, slot.map_width)
    for row in range(first_row, last_row):
        start = slot.map_offset + row * slot.map_width
        into = first - slot.window_column + 1
        window[row - slot.window_row + 1, into : into + last - first] = memory.distances[
            start + first : start + last
        ]


@compiled
def window_place(slot: Slot, x: float, y: float) -> tuple[float, float]:
    """Give a point [m] of the world in cells of the window: (column, row)."""
    return (
        (x - slot.map_x) / RESOLUTION_M - slot.window_column + 1.0,
        (y - slot.map_y) / RESOLUTION_M - slot.window_row + 1.0,
    )
