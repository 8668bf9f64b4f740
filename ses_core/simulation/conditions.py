"""`SimulationSettings` as compiled code needs them."""

from typing import NamedTuple

from ses_core.imperfections import resolve
from ses_core.settings import SimulationSettings

_PLAN_AGE_S = 2.0
"""The global planner's potential is computed anew after this at the latest [s]."""


class Conditions(NamedTuple):
    """Rates, rules and imperfections; durations in ticks where nothing else is said."""

    period: float  # [s]
    sense_every: int
    plan_age: int
    time_limit: int
    success_radius: float
    collisions_end: bool
    stuck_distance: float
    stuck_time: int
    clears_footprint: bool
    range_noise: float
    range_dropout: float
    scan_delay: int
    wheel_noise: float
    odometry_drift: float
    position_noise: float
    heading_noise: float


def conditions(settings: SimulationSettings) -> Conditions:
    """Prepare the settings for compiled code."""
    rate, levels = settings.control_rate_hz, resolve(settings.imperfections)
    return Conditions(
        period=1.0 / rate,
        sense_every=max(1, round(rate / settings.sensing_rate_hz)),
        plan_age=round(_PLAN_AGE_S * rate),
        time_limit=round(settings.time_limit_s * rate),
        success_radius=settings.success_radius_m,
        collisions_end=settings.collisions_end,
        stuck_distance=settings.stuck_distance_m,
        stuck_time=round(settings.stuck_time_s * rate),
        clears_footprint=settings.footprint_clearing,
        range_noise=levels.range_noise_m,
        range_dropout=levels.range_dropout,
        scan_delay=levels.scan_delay_ticks,
        wheel_noise=levels.wheel_noise,
        odometry_drift=levels.odometry_drift,
        position_noise=levels.position_noise_m,
        heading_noise=levels.heading_noise_rad,
    )
