"""What becomes of dirt in a log's streams: every rule mends or drops, and counts.

Counters whose name begins with `dropped_` are messages that were left out, so that for every log
messages in = messages used + the sum of what was dropped.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from ses_core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from ses_core.errors import LogError
from ses_core.robot_profile import RobotProfile

YEAR_1990_NS = 631_152_000_000_000_000
YEAR_2100_NS = 4_102_444_800_000_000_000
FARTHEST_POSITION_M = 1e6
"""A pose farther from its frame's origin is no pose."""

ABSURD_FACTOR = 2.0
"""A velocity beyond this multiple of the robot's limit says nothing about the robot."""


@dataclass(frozen=True, slots=True)
class CleanClock:
    """Which messages to keep, in which order.

    Attributes:
        order: (K,) indices of the messages that stay, by stamp.
        dropped: Messages whose stamp is outside the log's own era.
    """

    order: IntArray
    dropped: int


def clean_clock(stamps_ns: IntArray, warnings: Counter[str]) -> CleanClock:
    """Order messages by stamps (K,) [ns]; drop stamps of another era and repeated ones.

    Stamps from 0 on are the clock of a simulator and are used as they are.

    Raises:
        LogError: `bad_clock`: most stamps are negative or beyond 2100, or all are the same.
    """
    usable = (stamps_ns >= 0) & (stamps_ns < YEAR_2100_NS)
    if 2 * np.count_nonzero(usable) < len(stamps_ns):
        raise LogError("bad_clock", "most stamps lie before 1970 or after 2100")
    is_simulated = stamps_ns < YEAR_1990_NS
    if np.median(stamps_ns[usable]) < YEAR_1990_NS:
        warnings["clock_from_zero"] = 1
        keep = usable & is_simulated
    else:
        keep = usable & ~is_simulated
    indices = np.flatnonzero(keep)
    if len(indices) > 1 and np.ptp(stamps_ns[indices]) == 0:
        raise LogError("bad_clock", f"all {len(indices)} stamps are {stamps_ns[indices[0]]}")
    order = indices[np.argsort(stamps_ns[indices], kind="stable")]
    moved = np.count_nonzero(np.diff(stamps_ns[indices]) < 0)
    if moved:
        warnings["reordered"] += int(moved)
    return CleanClock(order=order, dropped=int(len(stamps_ns) - len(order)))


def first_of_each_stamp(stamps_ns: IntArray) -> BoolArray:
    """Tell which of the ordered stamps (K,) are not repetitions of the one before."""
    is_first: BoolArray = np.ones(len(stamps_ns), dtype=np.bool_)
    is_first[1:] = np.diff(stamps_ns) > 0
    return is_first


def usable_poses(poses: FloatArray) -> BoolArray:
    """Tell which poses (K, 3) are finite and within reach of the origin."""
    with np.errstate(invalid="ignore"):
        usable: BoolArray = np.isfinite(poses)
        usable[:, :2] &= np.abs(poses[:, :2]) < FARTHEST_POSITION_M
    return np.logical_and.reduce(usable, axis=1)


def plausible_twists(twists: FloatArray, profile: RobotProfile) -> tuple[FloatArray, int]:
    """Replace velocities (K, 2) no such robot can have by NaN, and count them.

    A twist is one statement: an absurd half makes all of it unknown.
    """
    limits = ABSURD_FACTOR * np.array([profile.max_speed_mps, profile.max_turn_rate_radps])
    with np.errstate(invalid="ignore"):
        plausible: BoolArray = np.all(np.abs(twists) <= limits, axis=1)
    clean = np.where(plausible[:, None], twists, np.nan)
    return clean, int(np.count_nonzero(~plausible))


def returns_only(ranges: Float32Array, *, range_min: float, range_max: float) -> Float32Array:
    """Write inf wherever ranges (..., B) [m] mean 'nothing came back'.

    Drivers write 0, NaN, infinity, less than `range_min` or `range_max` itself for that.
    """
    with np.errstate(invalid="ignore"):
        valid = (ranges > 0.0) & (ranges >= range_min) & (ranges < range_max)
    return np.where(valid, ranges, np.float32(np.inf)).astype(np.float32, copy=False)
