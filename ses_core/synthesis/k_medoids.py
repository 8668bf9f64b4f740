"""k-medoids by eager swaps (FasterPAM: Schubert and Rousseeuw, Information Systems 101, 2021).

Distances and weights are whole numbers, so that a loss is exact: a search ends when no swap
makes it smaller, and equal seeds end alike on every machine.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ses_core.arrays import IntArray
from ses_core.compilation import compiled

Int16Array = NDArray[np.int16]

STARTS = 4
"""The search is run from this many spread-out starts and the best medoids are kept."""

_FAR = 32_767
"""Distance to a second medoid where there is only one: more than any distance, as int16."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Partition:
    """Medoids and whom each stands for.

    Attributes:
        medoids: (k,) points, all different.
        nearest: (N,) which of the medoids is nearest to each point.
        loss: Distance of every point to its medoid, weighted and summed.
    """

    medoids: IntArray
    nearest: IntArray
    loss: int


def k_medoids(
    distances: Int16Array,
    weights: IntArray,
    *,
    count: int,
    rng: Generator,
    progress: Callable[[float], None] = lambda _: None,
) -> Partition:
    """Choose the points from which all others are least far away.

    Args:
        distances: (N, N), symmetric, more than 0 between different points.
        weights: (N,) how often each point counts, at least 1.
        count: k; all points where there are no more.
        rng: Source of chance.
        progress: Hears the share that is done, from 0 to 1.
    """
    found: list[tuple[int, IntArray]] = []
    for number in range(STARTS):
        medoids = spread_start(distances, weights, count=min(count, len(weights)), rng=rng)
        found.append((int(improve(distances, weights, medoids)), medoids))
        progress((number + 1) / STARTS)
    loss, medoids = min(found, key=lambda pair: pair[0])
    return Partition(medoids=medoids, nearest=distances[medoids].argmin(axis=0), loss=loss)


def spread_start(
    distances: Int16Array, weights: IntArray, *, count: int, rng: Generator
) -> IntArray:
    """Draw points (k,), each as likely as it adds to the loss of those before it.

    Distances instead of their squares, as the loss has them; else as in k-means++.
    """
    chosen = np.empty(count, dtype=np.int64)
    shortest = np.ones(len(weights), dtype=np.int64)
    for number in range(count):
        likely = np.cumsum(weights * shortest)
        chosen[number] = np.searchsorted(likely, rng.integers(likely[-1]), side="right")
        apart = distances[chosen[number]].astype(np.int64)
        shortest = apart if number == 0 else np.minimum(shortest, apart)
    return chosen


@compiled
def improve(distances: Int16Array, weights: IntArray, medoids: IntArray) -> int:
    """Swap a medoid for another point as long as that makes the loss smaller, in place.

    Every point is tried in turn and the best of its swaps is made at once if it helps.

    Args:
        distances: (N, N).
        weights: (N,).
        medoids: (k,) points to start from, all different; afterwards the best found.

    Returns:
        The loss: no swap of one medoid makes it smaller.
    """
    points = weights.size
    is_medoid = np.zeros(points, dtype=np.bool_)
    is_medoid[medoids] = True
    # By point: position of its nearest and second nearest medoid, and how far they are.
    places = np.empty((points, 2), dtype=np.int64)
    apart = np.empty((points, 2), dtype=np.int64)
    for point in range(points):
        find_two_nearest(distances, medoids, point, places, apart)
    candidate = 0
    tried_in_vain = 0
    while tried_in_vain < points:
        tried_in_vain += 1
        if not is_medoid[candidate]:
            position, change = _best_swap(
                distances[candidate], weights, medoids.size, places, apart
            )
            if change < 0:
                is_medoid[medoids[position]] = False
                is_medoid[candidate] = True
                medoids[position] = candidate
                follow_swap(distances, medoids, position, places, apart)
                tried_in_vain = 0
        candidate = (candidate + 1) % points
    return (weights * apart[:, 0]).sum()


@compiled
def _best_swap(
    row: Int16Array, weights: IntArray, count: int, places: IntArray, apart: IntArray
) -> tuple[int, int]:
    """Find the medoid to give up for a candidate with distances (N,), and the change of loss."""
    # Change by the new medoid whichever is given up, and what giving up each one adds to it.
    gain = 0
    losses = np.zeros(count, dtype=np.int64)
    for point in range(row.size):
        first, second = apart[point]
        distance = row[point]
        if distance < first:
            gain += weights[point] * (distance - first)
        else:
            losses[places[point, 0]] += weights[point] * (min(distance, second) - first)
    position = int(losses.argmin())
    return position, gain + losses[position]


@compiled
def follow_swap(
    distances: Int16Array, medoids: IntArray, position: int, places: IntArray, apart: IntArray
) -> None:
    """Bring the two nearest medoids of every point up to date with the new one at a position."""
    for point in range(places.shape[0]):
        distance = distances[medoids[position], point]
        if position in (places[point, 0], places[point, 1]):
            find_two_nearest(distances, medoids, point, places, apart)
        elif distance < apart[point, 0]:
            places[point, 1], apart[point, 1] = places[point, 0], apart[point, 0]
            places[point, 0], apart[point, 0] = position, distance
        elif distance < apart[point, 1]:
            places[point, 1], apart[point, 1] = position, distance


@compiled
def find_two_nearest(
    distances: Int16Array, medoids: IntArray, point: int, places: IntArray, apart: IntArray
) -> None:
    """Look up a point's two nearest medoids among all; position -1 where there is no second."""
    places[point] = -1
    apart[point] = _FAR
    for position in range(medoids.size):
        distance = distances[point, medoids[position]]
        if distance < apart[point, 0]:
            places[point, 1], apart[point, 1] = places[point, 0], apart[point, 0]
            places[point, 0], apart[point, 0] = position, distance
        elif distance < apart[point, 1]:
            places[point, 1], apart[point, 1] = position, distance
