"""How a number of the synthesized environments stands to that of the real ones."""

from typing import Literal

from ses_core.scorecard.rows import ScorecardRow

Standing = Literal["within", "too low", "too high", "unknown"]

SHIPPED = "traversable, shipped"

_EXACT = ("memorisation",)
"""Metrics whose real-against-real value holds by definition and has no interval."""


def standing(row: ScorecardRow) -> Standing:
    """Say whether a value is worse than real-against-real allows, and in which direction.

    It is where it lies outside the real-against-real interval on the side that `aim` calls worse,
    and the real value lies outside its own interval, if it has one. One of the two alone happens
    too easily: an interval of 95 % misses one number in twenty by chance.

    What is handed on has to be traversable, whatever real environments are: a share below 1 is
    too low by itself.
    """
    if row.metric == SHIPPED and row.value is not None:
        return "too low" if row.value < 1.0 else "within"
    if row.value is None or row.real_value is None:
        return "unknown"
    if row.real_low is None or row.real_high is None:
        if row.metric not in _EXACT:
            return "unknown"
        real = (row.real_value, row.real_value)
    else:
        real = (row.real_low, row.real_high)
    low = row.value if row.low is None else row.low
    high = row.value if row.high is None else row.high
    if row.aim != "low" and row.value < real[0] and high < row.real_value:
        return "too low"
    if row.aim != "high" and row.value > real[1] and low > row.real_value:
        return "too high"
    return "within"
