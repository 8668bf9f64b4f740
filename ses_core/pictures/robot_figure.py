"""Picture of a robot: its body and padding on the cells of an environment (leaf: matplotlib)."""

import math

import numpy as np
from matplotlib.patches import Polygon, Wedge

from ses_core.occupancy import ENVIRONMENT_RESOLUTION_M
from ses_core.pictures.figures import LIGHT, Theme, new_figure, png_bytes, style_axes
from ses_core.robot_profile import RobotProfile

_CELLS_AROUND = 4
"""Cells that are shown on each side of the robot's centre, or as many as it needs."""


def robot_figure(profile: RobotProfile, *, theme: Theme = LIGHT) -> bytes:
    """Draw a robot from above as PNG, driving up: body, padded footprint, what its laser sees.

    The lines are the edges of an environment's cells.
    """
    cells = max(
        _CELLS_AROUND, math.ceil(profile.circumscribed_radius_m / ENVIRONMENT_RESOLUTION_M) + 1
    )
    reach = cells * ENVIRONMENT_RESOLUTION_M
    figure = new_figure(3.6, 3.6, theme=theme)
    axes = figure.subplots()
    style_axes(axes, theme=theme)
    axes.set_aspect("equal")
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    edges = np.arange(-cells, cells + 1) * ENVIRONMENT_RESOLUTION_M
    axes.set_xticks(edges, minor=True)
    axes.set_yticks(edges, minor=True)
    axes.grid(visible=False, which="major")
    axes.grid(which="minor", color=theme.faint, linewidth=0.6)
    axes.tick_params(which="minor", length=0)
    axes.set_xlabel("[m]", fontsize=9)
    laser = profile.laser
    ahead = 90.0 + math.degrees(laser.mount_yaw_rad)
    first, last = math.degrees(laser.angle_min_rad), math.degrees(laser.angle_max_rad)
    mount = (-laser.mount_y_m, laser.mount_x_m)
    axes.add_patch(
        Wedge(mount, 3 * reach, ahead + first, ahead + last, fc=theme.series[5], alpha=0.15, lw=0)
    )
    padded, body = (
        np.array([(-y, x) for x, y in corners])
        for corners in (profile.padded_footprint(), profile.body())
    )
    axes.add_patch(Polygon(padded, fill=False, ec=theme.series[1], ls="--", lw=1.2))
    axes.add_patch(Polygon(body, fc=theme.series[1], ec=theme.series[1], alpha=0.6, lw=1.2))
    return png_bytes(figure)
