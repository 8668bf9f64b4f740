"""`Trajectory`: one unbroken drive on the 20 Hz clock, with the scans taken on it."""

from dataclasses import dataclass

from ses_core.arrays import BoolArray, FloatArray, IntArray
from ses_core.extraction.recording import ScanStream


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """tau: K steps of one robot without a gap or a jump (section III-B).

    Attributes:
        first_step: Number of the first step within its log; steps are never reused.
        stamps_ns: (K,) [ns UTC]; without a clock, poses are numbered 50 ms apart from 0.
        poses: (K, 3) [m, m, rad].
        commanded: (K, 2) [m/s, rad/s]; NaN where no command stream exists.
        measured: (K, 2) [m/s, rad/s]; NaN where no twist exists.
        speed: (K,) [m/s] the velocity that counts, by setting; NaN where unknown.
        has_clock: False where the log has no usable clock.
        scans: Scans taken during the drive, or None.
        scan_poses: (S, 3) [m, m, rad] pose of the body at each scan, or None.
    """

    first_step: int
    stamps_ns: IntArray
    poses: FloatArray
    commanded: FloatArray
    measured: FloatArray
    speed: FloatArray
    has_clock: bool
    scans: ScanStream | None
    scan_poses: FloatArray | None

    def __len__(self) -> int:
        return len(self.stamps_ns)


def negative_steps(trajectory: Trajectory) -> BoolArray:
    """Tell which steps (K,) have a negative linear velocity: c_k of the paper."""
    return trajectory.speed < 0.0


def known_steps(trajectory: Trajectory) -> BoolArray:
    """Tell at which steps (K,) the velocity that counts is known."""
    return trajectory.speed == trajectory.speed
