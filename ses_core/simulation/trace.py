"""`Trace`: whole episodes as they are driven, one row per control tick, written by the kernel.

Whoever wants every tick need not stop the slots after each: a slot that runs its ticks of a
second on end keeps its maps in the cache, and threads wait for one another once a second.
"""

from typing import NamedTuple

import numpy as np

from ses_core.arrays import Float32Array, FloatArray


class Trace(NamedTuple):
    """Row k of a slot holds its k-th tick, row 0 its start; a slot's next episode overwrites it.

    Rows beyond the newest tick hold what an earlier episode left. Without slots nothing is kept.
    """

    poses: FloatArray  # (N, K, 3) true poses in the world [m, m, rad]
    odometry: FloatArray  # (N, K, 3) what the robot believes [m, m, rad]
    velocities: FloatArray  # (N, K, 2) measured [m/s, rad/s]
    commands: FloatArray  # (N, K, 2) given in the tick that ended here [m/s, rad/s]
    scans: Float32Array  # (N, S, B) scans that arrived, one every `sense_every` ticks [m]


def make_trace(slots: int, *, ticks: int, sense_every: int, beams: int) -> Trace:
    """Make room for episodes of so many ticks."""
    rows = ticks + 1
    return Trace(
        poses=np.zeros((slots, rows, 3)),
        odometry=np.zeros((slots, rows, 3)),
        velocities=np.zeros((slots, rows, 2)),
        commands=np.zeros((slots, rows, 2)),
        scans=np.zeros((slots, ticks // sense_every + 1, beams), dtype=np.float32),
    )


NO_TRACE = make_trace(0, ticks=0, sense_every=1, beams=0)
