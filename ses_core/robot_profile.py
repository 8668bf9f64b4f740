"""`RobotProfile`: everything that differs from one robot to the next, and the profiles we know."""

import math
from typing import Self

from pydantic import Field, model_validator

from ses_core.settings_model import SettingsModel


class LaserProfile(SettingsModel):
    """A planar laser; used as it is in simulation, and to repair what a log leaves out."""

    beams: int = Field(720, ge=2, description="Readings per scan.")
    angle_min_rad: float = Field(-2.35619, description="Angle of the first beam.")
    angle_max_rad: float = Field(2.35619, description="Angle of the last beam.")
    range_min_m: float = Field(0.1, ge=0, description="Shorter readings mean 'no return'.")
    range_max_m: float = Field(30.0, gt=0, description="Longer readings mean 'no return'.")
    rate_hz: float = Field(20.0, gt=0, description="Scans per second.")
    mount_x_m: float = Field(0.0, description="Where the laser sits, ahead of the robot's centre.")
    mount_y_m: float = Field(0.0, description="Where the laser sits, left of the centre.")
    mount_yaw_rad: float = Field(0.0, description="How the laser is turned on the robot.")


class LocalPlannerProfile(SettingsModel):
    """What the local planner is set to and no policy changes, under `move_base` names.

    Defaults are jackal_navigation's base_local_planner_params.yaml.
    """

    min_vel_x: float = Field(0.1, ge=0, description="Slowest forward sample [m/s].")
    min_in_place_vel_theta: float = Field(
        0.314, ge=0, description="Slowest turn on the spot [rad/s]."
    )
    escape_vel: float = Field(-0.5, lt=0, description="Speed of backing up [m/s].")
    occdist_scale: float = Field(
        0.1, ge=0, description="Weight of the raw obstacle cost, which reaches 253."
    )
    heading_lookahead: float = Field(
        0.325, gt=0, description="Turns on the spot look this far ahead [m]."
    )
    oscillation_reset_dist: float = Field(
        0.05, ge=0, description="Moved this far, turning back is allowed again [m]."
    )
    escape_reset_dist: float = Field(0.1, ge=0, description="Moved this far, it got away [m].")
    escape_reset_theta: float = Field(0.1, ge=0, description="Turned this far, it got away [rad].")


class RobotProfile(SettingsModel):
    """One kind of robot: body, limits, laser, topics; defaults are the paper's Jackal.

    Sources: Clearpath's jackal_description, jackal_control and jackal_navigation packages.
    """

    name: str = Field("jackal", description="Name of the profile.")
    footprint_m: tuple[tuple[float, float], ...] = Field(
        ((0.21, 0.165), (0.21, -0.165), (-0.21, -0.165), (-0.21, 0.165)),
        description="Corners of the body around its centre; empty for a round robot.",
    )
    radius_m: float = Field(0.0, ge=0, description="Radius of a round robot; 0 for a polygon.")
    footprint_padding_m: float = Field(0.1, ge=0, description="Added to the footprint (costmap).")
    max_speed_mps: float = Field(
        2.0, gt=0, description="Fastest the body can go; faster between two poses is a jump."
    )
    max_turn_rate_radps: float = Field(4.0, gt=0, description="Fastest it can turn.")
    acc_lim_x_mps2: float = Field(10.0, gt=0, description="Planner's acceleration limit.")
    acc_lim_theta_radps2: float = Field(20.0, gt=0, description="Planner's angular limit.")
    sideslip_s: float = Field(
        0.04,
        ge=0,
        description="Skidding outwards in a turn: sideways speed over the product of speed and "
        "turn rate; as the four-wheeled robot does in PyBullet. 0 for one that does not skid.",
    )
    command_timeout_s: float = Field(
        0.25, gt=0, description="A command holds this long, then the base stops (cmd_vel_timeout)."
    )
    laser: LaserProfile = LaserProfile()
    planner: LocalPlannerProfile = LocalPlannerProfile()
    scan_topic: str | None = Field(None, description="Fix the topic; else it is found by type.")
    odometry_topic: str | None = Field(None, description="Fix the topic; else found by type.")
    command_topic: str | None = Field(None, description="Fix the topic; else found by type.")
    pose_topic: str | None = Field(None, description="Fix the topic; else found by type.")
    map_topic: str | None = Field(None, description="Fix the topic; else found by type.")
    base_frame: str | None = Field(None, description="Frame of the body; else the odometry's.")
    scan_frame_is_mount: bool = Field(
        False, description="Take the laser's mount from this profile, not from static transforms."
    )

    @model_validator(mode="after")
    def _has_one_shape(self) -> Self:
        if (len(self.footprint_m) >= 3) == (self.radius_m > 0):
            raise ValueError("a robot has either a footprint of 3 or more corners, or a radius")
        return self

    @property
    def inscribed_radius_m(self) -> float:
        """Largest circle around the centre inside the padded footprint [m]; Jackal 0.265."""
        if self.radius_m > 0:
            return self.radius_m + self.footprint_padding_m
        corners = self.padded_footprint()
        closing = (*corners[1:], corners[0])
        return min(
            _distance_to_segment(start, end) for start, end in zip(corners, closing, strict=True)
        )

    @property
    def circumscribed_radius_m(self) -> float:
        """Smallest circle around the centre that holds the padded footprint [m]; Jackal 0.408."""
        if self.radius_m > 0:
            return self.radius_m + self.footprint_padding_m
        return max(math.hypot(x, y) for x, y in self.padded_footprint())

    def body(self) -> tuple[tuple[float, float], ...]:
        """Corners [m] of the bare body; a round one as 16 corners."""
        if self.radius_m > 0:
            return _circle(self.radius_m)
        return self.footprint_m

    def padded_footprint(self) -> tuple[tuple[float, float], ...]:
        """Corners [m] moved outwards by the padding on each axis, as costmap_2d does."""
        if self.radius_m > 0:
            return _circle(self.radius_m + self.footprint_padding_m)
        pad = self.footprint_padding_m
        return tuple(
            (x + math.copysign(pad, x), y + math.copysign(pad, y)) for x, y in self.footprint_m
        )


def _circle(radius: float) -> tuple[tuple[float, float], ...]:
    return tuple(
        (radius * math.cos(k * math.pi / 8), radius * math.sin(k * math.pi / 8)) for k in range(16)
    )


def _distance_to_segment(start: tuple[float, float], end: tuple[float, float]) -> float:
    """Distance [m] from the origin to a segment."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    if length == 0.0:
        return math.hypot(*start)
    along = max(0.0, min(1.0, -(start[0] * dx + start[1] * dy) / length**2))
    return math.hypot(start[0] + along * dx, start[1] + along * dy)


JACKAL = RobotProfile()
"""The paper's robot: the default target of traversability and training."""

TURTLEBOT4 = RobotProfile(
    name="turtlebot4",
    footprint_m=(),
    radius_m=0.189,
    footprint_padding_m=0.03,
    max_speed_mps=0.46,
    max_turn_rate_radps=1.9,
    acc_lim_x_mps2=0.9,
    acc_lim_theta_radps2=7.725,
    sideslip_s=0.0,
    command_timeout_s=0.5,
    laser=LaserProfile(
        angle_min_rad=-math.pi, angle_max_rad=math.pi, range_max_m=12.0, range_min_m=0.15
    ),
)

NEATO = RobotProfile(
    name="neato",
    footprint_m=(),
    radius_m=0.17,
    footprint_padding_m=0.03,
    max_speed_mps=1.0,
    max_turn_rate_radps=4.0,
    acc_lim_x_mps2=1.0,
    acc_lim_theta_radps2=4.0,
    sideslip_s=0.0,
    command_timeout_s=1.0,
    laser=LaserProfile(
        beams=361, angle_min_rad=0.0, angle_max_rad=2 * math.pi, range_max_m=5.0, range_min_m=0.02
    ),
)

RASPIMOUSE = RobotProfile(
    name="raspimouse",
    footprint_m=(),
    radius_m=0.08,
    footprint_padding_m=0.03,
    max_speed_mps=1.0,
    max_turn_rate_radps=6.0,
    acc_lim_x_mps2=1.0,
    acc_lim_theta_radps2=6.0,
    sideslip_s=0.0,
    command_timeout_s=1.0,
    laser=LaserProfile(
        beams=726, angle_min_rad=-2.36, angle_max_rad=2.09, range_max_m=5.6, range_min_m=0.02
    ),
)

GENERIC = RobotProfile(
    name="generic",
    footprint_m=(),
    radius_m=0.25,
    footprint_padding_m=0.03,
    max_speed_mps=3.0,
    max_turn_rate_radps=6.0,
    sideslip_s=0.0,
    command_timeout_s=0.5,
    laser=LaserProfile(beams=361, range_max_m=30.0, range_min_m=0.02),
)
"""For a robot that no rule names: generous limits, so that only the impossible is cut."""

KNOWN_PROFILES = {
    profile.name: profile for profile in (JACKAL, TURTLEBOT4, NEATO, RASPIMOUSE, GENERIC)
}
