"""When a robot's messages are stamped, and when they are recorded: never on exact multiples.

A driver stamps what it has just read, a little off its timer's beat; the recorder has it a little
later. Log time orders a recording, and is what everything here is read by.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.random import Generator

from ses_core.arrays import FloatArray, IntArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Latency:
    """Delays of one topic [s].

    Attributes:
        jitter: Standard deviation of a stamp around its timer's beat.
        floor: Shortest time from the stamp to the recorder.
        mean: Mean of what comes on top, exponentially distributed.
        cap: Longest time from the stamp to the recorder.
    """

    jitter: float
    floor: float
    mean: float
    cap: float


# Real logs show medians of 0.2 ms to 4 ms from stamp to recorder, and a planner that thinks for
# some milliseconds before it speaks.
ODOMETRY: Final = Latency(jitter=3e-4, floor=2e-4, mean=4e-4, cap=8e-3)
TRANSFORM: Final = Latency(jitter=0.0, floor=1e-4, mean=2e-4, cap=4e-3)
SCAN: Final = Latency(jitter=5e-4, floor=2e-3, mean=1e-3, cap=12e-3)
COMMAND: Final = Latency(jitter=0.0, floor=6e-3, mean=2e-3, cap=18e-3)

_JITTER_LIMIT = 3.0
_PERIOD_SHARE = 0.4
"""No delay and no jitter is more than this share of the shortest interval: order is kept."""


@dataclass(frozen=True, slots=True)
class RecordedStamps:
    """Stamps in the messages and log times (K,) [ns]."""

    header_ns: IntArray
    log_ns: IntArray


def record_stamps(times_ns: IntArray, latency: Latency, *, rng: Generator) -> RecordedStamps:
    """Stamp messages that are due at ascending times (K,) [ns]."""
    if not len(times_ns):
        return RecordedStamps(times_ns, times_ns)
    shortest = float(np.diff(times_ns).min()) * 1e-9 if len(times_ns) > 1 else 1.0
    limit = _PERIOD_SHARE * shortest
    jitter = latency.jitter * np.clip(
        rng.standard_normal(len(times_ns)), -_JITTER_LIMIT, _JITTER_LIMIT
    )
    header = times_ns + _nanoseconds(np.clip(jitter, -limit, limit))
    delay = latency.floor + rng.exponential(latency.mean, len(times_ns))
    log = header + _nanoseconds(np.minimum(delay, min(latency.cap, limit)))
    return RecordedStamps(header, np.maximum.accumulate(log))


def _nanoseconds(seconds: FloatArray) -> IntArray:
    return np.rint(seconds * 1e9).astype(np.int64)
