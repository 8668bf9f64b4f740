"""The costmap a scan builds: marks, clearing, distances and inflated costs (costmap_2d).

One map per robot holds all it has seen, at 0.05 m, unknown counting as free; the local costmap is
a 10 x 10 m window of it. Local and global costmap of the Jackal see the same scans through the
same layers, so they are one map here. Sources: costmap_2d's obstacle and inflation layers,
jackal_navigation's costmap parameters.
"""

import math

import numpy as np

from ses_core.arrays import ByteArray, Float32Array, FloatArray
from ses_core.compilation import compiled_in_place
from ses_core.planning.passed_cells import beams_per_radian, is_passed
from ses_core.simulation.robot import RobotModel
from ses_core.simulation.state import Int16Array, Int32Array, Memory, Scratch, Slot

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
_FAR_16 = np.int16(FAR_CELLS)
_FAR_SQUARED = np.int16(FAR)
_BEYOND = np.int16(FAR_CELLS * FAR_CELLS)
_SEEN_NOW = 2  # flag on a mark while one scan is worked in


@compiled_in_place
def inflation_cells(inflation_radius: float) -> int:
    """Give the inflation radius in cells; 0.3 m are 6, whatever 0.3 / 0.05 rounds to."""
    return math.ceil(inflation_radius / RESOLUTION_M - 1e-9)


@compiled_in_place
def inflation_costs(costs: Float32Array, inflation_radius: float, inscribed_radius: float) -> None:
    """Fill the cost (256,) of each squared distance [cells^2] to the nearest obstacle.

    As costmap_2d: the inflation radius counts in whole cells, rounded up, and beyond it there is
    nothing, not even the inscribed cost.
    """
    reach = inflation_cells(inflation_radius)
    for squared in range(256):
        distance = RESOLUTION_M * math.sqrt(squared)
        if squared == 0:
            costs[squared] = LETHAL
        elif squared == FAR or squared > reach * reach:
            costs[squared] = 0.0
        elif distance <= inscribed_radius:
            costs[squared] = INSCRIBED
        else:
            costs[squared] = math.floor(
                (INSCRIBED - 1.0) * math.exp(-COST_SCALING_FACTOR * (distance - inscribed_radius))
            )


@compiled_in_place
def work_in_scan(
    slot: Slot,
    memory: Memory,
    ranges: Float32Array,
    robot: RobotModel,
    hits: Int32Array,
    clears_footprint: bool,
) -> None:
    """Mark hits, clear what beams pass through and what the robot stands on.

    A beam without a return neither marks nor clears. Only net changes count as changes: a mark
    that this scan would clear and set again was never gone.

    `hits` is working space for the cells of at least B hits; `clears_footprint` is costmap_2d's
    `footprint_clearing_enabled`.
    """
    cosine, sine = math.cos(slot.scan_yaw), math.sin(slot.scan_yaw)
    column = (
        slot.scan_x + cosine * robot.mount_x - sine * robot.mount_y - slot.map_x
    ) / RESOLUTION_M
    row = (slot.scan_y + sine * robot.mount_x + cosine * robot.mount_y - slot.map_y) / RESOLUTION_M
    cosine, sine = (
        math.cos(slot.scan_yaw + robot.mount_yaw),
        math.sin(slot.scan_yaw + robot.mount_yaw),
    )
    count = 0
    for beam in range(ranges.shape[0]):
        if ranges[beam] >= OBSTACLE_RANGE_M:
            continue
        cells = ranges[beam] / RESOLUTION_M
        along_x = cosine * robot.beams[beam, 0] - sine * robot.beams[beam, 1]
        along_y = sine * robot.beams[beam, 0] + cosine * robot.beams[beam, 1]
        index = _map_index(slot, column + cells * along_x, row + cells * along_y)
        if index >= 0 and memory.marks[index] < _SEEN_NOW:
            memory.marks[index] |= _SEEN_NOW
            hits[count] = index
            count += 1
    _clear_passed(slot, memory, ranges, robot, column, row, cosine, sine)
    if clears_footprint:
        _clear_footprint(slot, memory, robot)
    for k in range(count):
        mark = memory.marks[hits[k]]
        if mark >= _SEEN_NOW:
            if mark == _SEEN_NOW:
                _note_change(slot, hits[k])
            memory.marks[hits[k]] = 1


@compiled_in_place
def _map_index(slot: Slot, column: float, row: float) -> int:
    """Give the flat index of the map cell that holds a point [cells], or -1 outside the map."""
    if not (0.0 <= column < slot.map_width and 0.0 <= row < slot.map_height):
        return -1
    return slot.map_offset + int(row) * slot.map_width + int(column)


@compiled_in_place
def _clear_passed(
    slot: Slot,
    memory: Memory,
    ranges: Float32Array,
    robot: RobotModel,
    column: float,
    row: float,
    cosine: float,
    sine: float,
) -> None:
    """Clear the marks that beams pass over or end on, for a laser at (column, row) [cells].

    A beam passes over the cells at whole steps along its faster axis. There are a few hundred
    marks but tens of thousands of such steps, so each mark looks for its beams instead.
    """
    per_radian = beams_per_radian(robot.beams)
    reach = int(RAYTRACE_RANGE_M / RESOLUTION_M) + 1
    left, right = max(int(column) - reach, 0), min(int(column) + reach + 1, slot.map_width)
    bottom, top = max(int(row) - reach, 0), min(int(row) + reach + 1, slot.map_height)
    for cell_row in range(bottom, top):
        start = slot.map_offset + cell_row * slot.map_width
        for cell_column in range(left, right):
            if memory.marks[start + cell_column] == 1 and is_passed(
                ranges,
                robot.beams,
                per_radian,
                column,
                row,
                cosine,
                sine,
                cell_column,
                cell_row,
                RESOLUTION_M,
                RAYTRACE_RANGE_M,
            ):
                memory.marks[start + cell_column] = 0
                _note_change(slot, start + cell_column)


@compiled_in_place
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


@compiled_in_place
def is_inside(sides: FloatArray, x: float, y: float) -> bool:
    """Tell whether a point [m] in the robot's frame lies in a convex polygon (E, 3)."""
    is_in = True
    for k in range(sides.shape[0]):
        is_in = is_in and sides[k, 0] * x + sides[k, 1] * y <= sides[k, 2]
    return is_in


@compiled_in_place
def _note_change(slot: Slot, index: int) -> None:
    cell = index - slot.map_offset
    row = cell // slot.map_width
    column = cell - row * slot.map_width
    slot.changed_left = min(slot.changed_left, column)
    slot.changed_right = max(slot.changed_right, column)
    slot.changed_bottom = min(slot.changed_bottom, row)
    slot.changed_top = max(slot.changed_top, row)


@compiled_in_place
def forget_changes(slot: Slot) -> None:
    """Declare every distance up to date."""
    slot.changed_left, slot.changed_right = slot.map_width, -1
    slot.changed_bottom, slot.changed_top = slot.map_height, -1


@compiled_in_place
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
    columns = scratch.columns[worker]
    first, last = max(left - FAR_CELLS, 0), min(right + FAR_CELLS, width)
    into = first - left + FAR_CELLS  # column `left` of the map lies at place 16
    span, reached = right - left, last - first
    for line in range(top - bottom):
        for place in range(span + 2 * FAR_CELLS):
            columns[line, place] = _BEYOND
    run = columns[columns.shape[0] - 1]
    for upwards in (True, False):
        for place in range(reached):
            run[place] = FAR_CELLS
        begin = max(bottom - FAR_CELLS, 0) if upwards else min(top + FAR_CELLS, height) - 1
        end = top if upwards else bottom - 1
        for row in range(begin, end, 1 if upwards else -1):
            start = slot.map_offset + row * width
            _lengthen(run[:reached], memory.marks[start + first : start + last])
            if bottom <= row < top:
                _keep_least_square(columns[row - bottom, into : into + reached], run[:reached])
    for row in range(bottom, top):
        start = slot.map_offset + row * width + left
        _lower_envelope(memory.distances[start : start + span], columns[row - bottom])
    forget_changes(slot)


# The arithmetic below stays in 16 bits: numba would widen it to 64 and lose most vector lanes.


@compiled_in_place
def _lengthen(run: Int16Array, marks: ByteArray) -> None:
    """Count one more cell since the last mark, in every column."""
    for place in range(run.shape[0]):
        longer = min(np.int16(run[place] + 1), _FAR_16)
        run[place] = longer if marks[place] == 0 else np.int16(0)


@compiled_in_place
def _keep_least_square(line: Int16Array, run: Int16Array) -> None:
    for place in range(run.shape[0]):
        line[place] = min(line[place], np.int16(run[place] * run[place]))


@compiled_in_place
def _lower_envelope(distances: ByteArray, line: Int16Array) -> None:
    """Combine squared distances along columns over the 31 columns around each cell.

    Cell by cell: the inner loop is short and of fixed length, so that it is unrolled and the
    outer one runs in vector lanes, reading each value of the line from the cache only.
    """
    for cell in range(distances.shape[0]):
        best = line[cell + FAR_CELLS]
        for away in range(1, FAR_CELLS):
            nearer = min(line[cell + FAR_CELLS - away], line[cell + FAR_CELLS + away])
            best = min(best, np.int16(nearer + np.int16(away * away)))
        distances[cell] = np.uint8(min(best, _FAR_SQUARED))


@compiled_in_place
def centre_window(slot: Slot, memory: Memory, number: int) -> None:
    """Copy the 10 x 10 m around the robot into the slot's window; beyond the map is lethal."""
    slot.window_column = int((slot.x - slot.map_x) / RESOLUTION_M) - _HALF_WINDOW
    slot.window_row = int((slot.y - slot.map_y) / RESOLUTION_M) - _HALF_WINDOW
    window = memory.window_distances[number]
    first_row = max(slot.window_row, 0)
    last_row = min(slot.window_row + WINDOW_CELLS, slot.map_height)
    first = max(slot.window_column, 0)
    span = min(slot.window_column + WINDOW_CELLS, slot.map_width) - first
    into = first - slot.window_column + 1
    window[: first_row - slot.window_row + 1] = 0
    window[last_row - slot.window_row + 1 :] = 0
    for row in range(first_row, last_row):
        start = slot.map_offset + row * slot.map_width + first
        line = window[row - slot.window_row + 1]
        line[:into] = 0
        line[into + span :] = 0
        _copy(line[into : into + span], memory.distances[start : start + span])


@compiled_in_place
def _copy(target: ByteArray, source: ByteArray) -> None:
    """Copy a line; numba's own assignment between slices does not run in vector lanes."""
    for place in range(target.shape[0]):
        target[place] = source[place]


@compiled_in_place
def window_place(slot: Slot, x: float, y: float) -> tuple[float, float]:
    """Give a point [m] of the world in cells of the window: (column, row)."""
    return (
        (x - slot.map_x) / RESOLUTION_M - slot.window_column + 1.0,
        (y - slot.map_y) / RESOLUTION_M - slot.window_row + 1.0,
    )
