"""The robot as rigid bodies: a chassis on four skid-steered wheels, written as URDF.

Numbers of the Jackal are those of Clearpath's jackal_description. Other profiles get a chassis
of their own outline on wheels in the Jackal's proportions.
"""

from dataclasses import dataclass

import numpy as np

from ses_core.robot_profile import RobotProfile

WHEELS = ("front_left", "rear_left", "front_right", "rear_right")
"""Links and joints in PyBullet's order: wheel k is link and joint k."""

CHASSIS_LINK = -1
"""PyBullet's index of a body's base."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotFrame:
    """Sizes [m] and masses [kg] of a four-wheeled robot."""

    length: float
    width: float
    height: float
    ground_clearance: float
    chassis_mass: float
    wheel_mass: float
    wheel_radius: float
    wheel_width: float
    wheelbase: float
    track: float
    is_round: bool = False


JACKAL_FRAME = RobotFrame(
    length=0.420,
    width=0.310,
    height=0.184,
    ground_clearance=0.0635,
    chassis_mass=16.523,
    wheel_mass=0.477,
    wheel_radius=0.098,
    wheel_width=0.040,
    wheelbase=0.262,
    track=0.37559,
)


def robot_frame(profile: RobotProfile) -> RobotFrame:
    """Give the frame of a profile's robot: the Jackal's, scaled to the profile's own body."""
    body = np.asarray(profile.body())
    length, width = np.ptp(body, axis=0).tolist()
    jackal = JACKAL_FRAME
    scale = length / jackal.length
    return RobotFrame(
        length=length,
        width=width,
        height=jackal.height * scale,
        ground_clearance=jackal.ground_clearance * scale,
        chassis_mass=jackal.chassis_mass * scale**3,
        wheel_mass=jackal.wheel_mass * scale**3,
        wheel_radius=jackal.wheel_radius * scale,
        wheel_width=jackal.wheel_width * scale,
        wheelbase=jackal.wheelbase * scale,
        track=jackal.track * scale,
        is_round=profile.radius_m > 0,
    )


def robot_urdf(frame: RobotFrame, *, name: str) -> str:
    """Write a robot as URDF; its base is the chassis, its joints turn the wheels."""
    if frame.is_round:
        shape = f'<cylinder radius="{frame.length / 2:.5f}" length="{frame.height:.5f}"/>'
    else:
        shape = f'<box size="{frame.length:.5f} {frame.width:.5f} {frame.height:.5f}"/>'
    wheel_z = frame.wheel_radius - frame.ground_clearance - frame.height / 2
    links = [
        _link("chassis", shape, frame.chassis_mass, _box_inertia(frame), colour="0.95 0.75 0.1 1")
    ]
    for wheel in WHEELS:
        x = (0.5 if wheel.startswith("front") else -0.5) * frame.wheelbase
        y = (0.5 if wheel.endswith("left") else -0.5) * frame.track
        shape = f'<cylinder radius="{frame.wheel_radius:.5f}" length="{frame.wheel_width:.5f}"/>'
        links.append(
            _link(
                wheel,
                shape,
                frame.wheel_mass,
                _wheel_inertia(frame),
                colour="0.1 0.1 0.1 1",
                # One point of contact: a cylinder rolls on changing corners and pulls aside.
                touches_as=f'<sphere radius="{frame.wheel_radius:.5f}"/>',
            )
        )
        links.append(
            f'<joint name="{wheel}" type="continuous"><parent link="chassis"/>'
            f'<child link="{wheel}"/><origin xyz="{x:.5f} {y:.5f} {wheel_z:.5f}" '
            'rpy="-1.57079633 0 0"/><axis xyz="0 0 1"/></joint>'
        )
    return f'<robot name="{name}">\n' + "\n".join(links) + "\n</robot>\n"


def _link(
    name: str,
    shape: str,
    mass: float,
    inertia: tuple[float, float, float],
    *,
    colour: str,
    touches_as: str = "",
) -> str:
    ixx, iyy, izz = inertia
    return (
        f'<link name="{name}"><inertial><mass value="{mass:.5f}"/>'
        f'<inertia ixx="{ixx:.7f}" iyy="{iyy:.7f}" izz="{izz:.7f}" ixy="0" ixz="0" iyz="0"/>'
        f"</inertial><visual><geometry>{shape}</geometry>"
        f'<material name="{name}"><color rgba="{colour}"/></material></visual>'
        f"<collision><geometry>{touches_as or shape}</geometry></collision></link>"
    )


def _box_inertia(frame: RobotFrame) -> tuple[float, float, float]:
    """Moments of inertia [kg m^2] of the chassis as a solid box."""
    x, y, z = frame.length**2, frame.width**2, frame.height**2
    twelfth = frame.chassis_mass / 12
    return twelfth * (y + z), twelfth * (x + z), twelfth * (x + y)


def _wheel_inertia(frame: RobotFrame) -> tuple[float, float, float]:
    """Moments of inertia [kg m^2] of a wheel, a solid cylinder about its z axis."""
    across = frame.wheel_mass * (3 * frame.wheel_radius**2 + frame.wheel_width**2) / 12
    return across, across, frame.wheel_mass * frame.wheel_radius**2 / 2
