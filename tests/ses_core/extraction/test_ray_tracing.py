"""Beams through cells, against a reference that tests every cell against every beam."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ses_core.arrays import FloatArray
from ses_core.extraction.ray_tracing import Evidence, trace_scans

SIZE, RESOLUTION, ORIGIN = 12, 0.25, (-1.0, -1.5)


def trace(ranges: FloatArray, angles: FloatArray, poses: FloatArray, far: float) -> Evidence:
    return trace_scans(
        ranges.astype(np.float32),
        angles,
        poses,
        range_max=far,
        origin=ORIGIN,
        resolution=RESOLUTION,
        size=SIZE,
    )


def crossed_length(start: FloatArray, end: FloatArray, row: int, column: int) -> float:
    """Length [m] of a segment inside one cell, by clipping it against the cell's four sides."""
    low = np.array(ORIGIN) + RESOLUTION * np.array([column, row])
    enter, leave = 0.0, 1.0
    for axis in range(2):
        delta = end[axis] - start[axis]
        if delta == 0.0:
            if not low[axis] <= start[axis] < low[axis] + RESOLUTION:
                return 0.0
            continue
        sides = sorted(
            ((low[axis] - start[axis]) / delta, (low[axis] + RESOLUTION - start[axis]) / delta)
        )
        enter, leave = max(enter, sides[0]), min(leave, sides[1])
    return max(0.0, leave - enter) * float(np.hypot(*(end - start)))


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_hits_and_passes_equal_those_of_the_reference(seed: int) -> None:
    rng = np.random.default_rng(seed)
    beams = int(rng.integers(1, 9))
    angles = np.sort(rng.uniform(-math.pi, math.pi, beams))
    poses = rng.uniform((-2.0, -2.0, -math.pi), (3.0, 3.0, math.pi), (3, 3))
    ranges = rng.uniform(0.1, 4.0, (3, beams)).astype(np.float32).astype(np.float64)
    found = trace(ranges, angles, poses, 10.0)

    hits, least, most = (np.zeros((SIZE, SIZE), dtype=np.int64) for _ in range(3))
    for pose, scan in zip(poses, ranges, strict=True):
        ends = pose[:2] + scan[:, None] * np.column_stack(
            (np.cos(pose[2] + angles), np.sin(pose[2] + angles))
        )
        for row in range(SIZE):
            for column in range(SIZE):
                cell = (ends - ORIGIN) // RESOLUTION
                if (cell == (column, row)).all(axis=1).any():
                    hits[row, column] += 1
                    continue
                longest = max(crossed_length(pose[:2], end, row, column) for end in ends)
                # A beam that only touches a corner may count either way.
                least[row, column] += longest > 1e-9
                most[row, column] += longest > -1e-9 and _is_near(pose, ends, row, column)
    assert (found.hits == hits).all()
    assert (found.passes >= least).all()
    assert (found.passes <= most).all()


def _is_near(pose: FloatArray, ends: FloatArray, row: int, column: int) -> bool:
    """Tell whether a beam comes within a nanometre of a cell."""
    middle = np.array(ORIGIN) + RESOLUTION * np.array([column + 0.5, row + 0.5])
    for end in ends:
        share = np.clip(
            np.dot(middle - pose[:2], end - pose[:2]) / np.dot(end - pose[:2], end - pose[:2]), 0, 1
        )
        nearest = pose[:2] + share * (end - pose[:2])
        if crossed_length(pose[:2], end, row, column) > 0.0:
            return True
        if np.abs(nearest - middle).max() <= RESOLUTION / 2 + 1e-9:
            return True
    return False


def test_a_cell_counts_once_per_scan_and_a_hit_wins() -> None:
    # The lower beam ends in the cell that the upper one runs through.
    angles = np.array([0.0, 0.001])
    found = trace(np.array([[1.1, 1.9]]), angles, np.array([[-0.9, -1.4, 0.0]]), 10.0)
    assert found.hits[0, 4] == 1
    assert found.passes[0, 4] == 0
    assert found.passes[0, 0] == 1


def test_a_beam_without_return_shows_no_more_than_its_neighbours() -> None:
    angles = np.array([-0.01, 0.0, 0.01])
    poses = np.array([[-0.9, -0.4, 0.0]])
    between = trace(np.array([[0.6, np.inf, 1.6]]), angles, poses, 10.0)
    alone = trace(np.array([[np.inf, np.inf, np.inf]]), angles, poses, 1.6)
    assert between.hits.sum() == 2
    assert between.passes[4, 1] == 1
    # Only the third beam looks past the end of the first, which is nearer.
    single = trace(np.array([[np.inf, 0.6, np.inf]]), angles, poses, 10.0)
    assert single.passes[4].tolist()[3:] == [0] * 9
    assert alone.hits.sum() == 0
    assert alone.passes[4].tolist() == [1] * 7 + [0] * 5


def test_readings_that_are_no_distance_are_no_hits() -> None:
    angles = np.array([0.0])
    poses = np.array([[-0.9, -0.4, 0.0]])
    for reading in (0.0, -1.0, np.nan, np.inf, 2.1):
        assert trace(np.array([[reading]]), angles, poses, 2.0).hits.sum() == 0
    assert trace(np.array([[2.0]]), angles, poses, 2.0).hits.sum() == 1
