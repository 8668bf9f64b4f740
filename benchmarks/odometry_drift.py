"""How far wheel odometry is off: recorded against scan-matched poses, over windows of 5 to 30 m.

The CARMEN logs of the shared data are of wheeled robots without a gyroscope. What follows from
the values for the preset `real` stands in `docs/imperfections.md`.

Both poses of a FLASER line are the corrected one. But the ODOM lines up to it go on from the last
corrected pose by odometry, so a FLASER's jump is the error of the stretch before it.
"""

import gzip
import os
from pathlib import Path

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.errors import SesError
from ses_core.geometry import wrap_angles

Row = dict[str, str | float]

_WINDOWS_M = np.array([5.0, 10.0, 15.0, 20.0, 25.0, 30.0])
_RAW_CHAIN = 0.02
"""Poses that move sideways by a larger share than this are no wheel odometry."""


def measure(scratch: Path) -> list[Row]:  # noqa: ARG001 - what every benchmark takes
    """Fit each log's drift: shares of way and turns, curl, and wander of the heading.

    Raises:
        SesError: The shared data are not there.
    """
    beside = Path(__file__).parents[2] / "shared" / "data"
    logs = Path(os.environ.get("SES_SHARED_DATA", beside)) / "logs" / "carmen"
    if not logs.is_dir():
        raise SesError("found no recorded logs: set SES_SHARED_DATA to the folder that holds logs/")
    return [_fit(path) for path in sorted(logs.glob("*.gz"))]


def _fit(path: Path) -> Row:
    """Fit one log; only its quality where its ODOM lines are no wheel odometry.

    Turns' errors are a share of the turn, a curl per way and the rest, whose variance over
    windows grows with the way as a random walk does, from a jitter of both ends on.
    """
    by_odometry, corrected, sideways = _stretches(path)
    way, turn = np.abs(corrected[:, 0]), corrected[:, 2]
    row: Row = {
        "log": path.name.removesuffix("-corrected.log.gz"),
        "way [m]": round(float(np.sum(way)), 1),
        "stretches": len(way),
        "sideways [share]": round(sideways, 4),
    }
    error = by_odometry - corrected
    error[:, 2] = wrap_angles(error[:, 2])
    (way_share,) = np.linalg.lstsq(corrected[:, :1], error[:, 0], rcond=None)[0]
    design = np.column_stack((way, turn))
    curl, turn_share = np.linalg.lstsq(design, error[:, 2], rcond=None)[0]
    wander, jitter = _growth(way, error[:, 2] - design @ np.array([curl, turn_share]))
    per_window = _window_sums(way, error[:, 0] - way_share * corrected[:, 0], 10.0) / 10.0
    fitted = {
        "way off [share]": way_share,
        "way, 10 m scatter [share]": np.std(per_window),
        "turns off [share]": turn_share,
        "curl [rad/m]": curl,
        "wander [rad/sqrt(m)]": wander,
        "end jitter [rad]": jitter,
    }
    is_raw = sideways <= _RAW_CHAIN
    return row | {name: round(float(v), 4) if is_raw else "-" for name, v in fitted.items()}


def _growth(way: FloatArray, error: FloatArray) -> tuple[float, float]:
    """Split errors' growth with the way into a random walk [/sqrt(m)] and a jitter of each end."""
    variances = [np.var(_window_sums(way, error, length)) for length in _WINDOWS_M]
    design = np.column_stack((_WINDOWS_M, np.full(len(_WINDOWS_M), 2.0)))
    walk, jitter = np.linalg.lstsq(design, np.array(variances), rcond=None)[0]
    return float(np.sqrt(max(walk, 0.0))), float(np.sqrt(max(jitter, 0.0)))


def _window_sums(way: FloatArray, error: FloatArray, length: float) -> FloatArray:
    """Give the errors summed over every window of a length; windows overlap."""
    driven = np.concatenate(([0.0], np.cumsum(way)))
    total = np.concatenate(([0.0], np.cumsum(error)))
    ends = np.searchsorted(driven, driven + length)
    starts = np.flatnonzero(ends < len(driven))
    return total[ends[starts]] - total[starts]


def _stretches(path: Path) -> tuple[FloatArray, FloatArray, float]:
    """Give motions (K, 3) from scan to scan by odometry and corrected, and the sideways share."""
    by_odometry, corrected, sideways = [], [], []
    last_scan = last = None
    with gzip.open(path, "rt", encoding="ascii", errors="replace") as lines:
        for words in (line.split() for line in lines):
            if not words or words[0] not in ("ODOM", "FLASER"):
                continue
            first = 1 if words[0] == "ODOM" else 2 + int(words[1])
            pose = np.array([float(word) for word in words[first : first + 3]])
            if words[0] == "FLASER":
                if last_scan is not None and last is not None:
                    by_odometry.append(_motion(last_scan, last))
                    corrected.append(_motion(last_scan, pose))
                last_scan = pose
            elif last is not None:
                ahead, left, turned = _motion(last, pose)
                if ahead > 0.02:
                    sideways.append(abs(left - ahead * turned / 2.0) / ahead)
            last = pose
    return np.array(by_odometry), np.array(corrected), float(np.median(sideways))


def _motion(start: FloatArray, end: FloatArray) -> FloatArray:
    """Give a pose (3,) as seen from another."""
    cosine, sine = np.cos(start[2]), np.sin(start[2])
    x, y = end[:2] - start[:2]
    turned = wrap_angles(np.array([end[2] - start[2]]))[0]
    return np.array([cosine * x + sine * y, cosine * y - sine * x, turned])
