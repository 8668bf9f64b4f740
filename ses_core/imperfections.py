"""What a real robot does worse than a clean simulator: one group of levels, and its presets."""

from typing import Literal

from pydantic import Field

from ses_core.settings_model import SettingsModel


class Imperfections(SettingsModel):
    """How far sensing, localisation, driving and starting are from ideal; all of it seeded.

    The defaults are the preset `real`. Where its levels come from stands in
    `docs/imperfections.md`; none was fitted to how often a robot succeeds.
    """

    range_noise_m: float = Field(0.012, ge=0, description="Standard deviation of a reading.")
    range_dropout: float = Field(0.005, ge=0, le=1, description="Share of readings lost.")
    scan_delay_ticks: int = Field(
        1, ge=0, description="Ticks from taking a scan to having it in the costmap."
    )
    command_delay_ticks: int = Field(2, ge=0, description="Ticks before a command takes effect.")
    wheel_noise: float = Field(
        0.05, ge=0, description="Relative standard deviation of each side's wheel speed, per tick."
    )
    turn_slip: float = Field(
        0.1,
        ge=0,
        le=0.3,
        description="Relative standard deviation, between episodes, of how far skidding wheels "
        "turn the robot.",
    )
    odometry_drift: float = Field(
        0.01,
        ge=0,
        le=0.2,
        description="Error of the pose that the stack believes: standard deviation, between "
        "episodes, of the share by which ways and turns are off, and wander of the heading "
        "[rad per square root of a metre].",
    )
    position_noise_m: float = Field(
        0.0, ge=0, description="Jitter of the believed position, per tick and axis."
    )
    heading_noise_rad: float = Field(0.0, ge=0, description="Jitter of the believed heading.")
    start_shift_m: float = Field(0.25, ge=0, description="A start is off by up to this.")
    start_turn_rad: float = Field(0.157, ge=0, description="A start is turned by up to this.")


PresetName = Literal["clean", "half", "real", "double"]

REAL = Imperfections()

_LEVELS = {name: getattr(REAL, name) for name in Imperfections.model_fields}

PRESETS: dict[PresetName, Imperfections] = {
    "clean": Imperfections(**dict.fromkeys(_LEVELS, 0)),
    # Half a tick of delay is still a tick.
    "half": Imperfections(
        **{
            name: -(-level // 2) if isinstance(level, int) else level / 2
            for name, level in _LEVELS.items()
        }
    ),
    "real": REAL,
    "double": Imperfections(**{name: 2 * level for name, level in _LEVELS.items()}),
}
"""Levels by name; `real` is frozen: what was learned under it must stay comparable."""


def resolve(chosen: PresetName | Imperfections) -> Imperfections:
    """Give the levels that a preset's name stands for, or levels of one's own as they are."""
    return PRESETS[chosen] if isinstance(chosen, str) else chosen
