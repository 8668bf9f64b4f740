"""`FleetSettings`: how a simulated fleet's day is laid out, and what its robots record."""

from typing import Final

from pydantic import Field

from ses_core.settings_model import SettingsModel

START_WINDOW_S: Final = 2.0
"""Drives begin up to this much later than planned."""

_SHORTEST_PAUSE_S: Final = START_WINDOW_S + 8.0
"""What is left of a pause must stay longer than the gap that cuts a log into drives."""


class FleetSettings(SettingsModel):
    """Robots, logs and what is in them; how far odometry drifts is an imperfection."""

    robots_per_site: int = Field(2, ge=1, description="Robots that take turns in a world.")
    drives_per_log: int | None = Field(
        None,
        ge=1,
        description="Drives of a robot that one log holds; by default 1, and 50 in tables.",
    )
    split_s: float | None = Field(
        None, gt=0, description="MCAP and db3: go on in a new file after so long, within a log."
    )
    pause_s: float = Field(
        50.0,
        ge=_SHORTEST_PAUSE_S,
        description="From the longest drive's end to the robot's next planned start, at least 10: "
        "starts vary by 2 s, and 5 s without a pose tell two drives of a log apart.",
    )
    publishes_map: bool = Field(
        False, description="Record the world as a map, and where the odometry lies in it."
    )
