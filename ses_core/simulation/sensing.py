"""What a slot senses: a scan from where the robot truly is, put where it believes to be."""

import math

import numpy as np

from ses_core.arrays import Float32Array
from ses_core.compilation import compiled, compiled_in_place
from ses_core.planning.costmap import centre_window, refresh_distances, work_in_scan
from ses_core.planning.distance_maps import measure_distances
from ses_core.planning.global_planner import update_plan
from ses_core.simulation.conditions import Conditions
from ses_core.simulation.lidar import cast_scan
from ses_core.simulation.noise import draw_normal, draw_uniform
from ses_core.simulation.robot import RobotModel
from ses_core.simulation.state import Memory, Scratch, Slot


@compiled
def sense(
    slot: Slot,
    memory: Memory,
    number: int,
    robot: RobotModel,
    setup: Conditions,
    scratch: Scratch,
    worker: int,
) -> None:
    """Take a scan, work it into the map, and bring plan and local maps up to date."""
    take_scan(slot, memory, number, robot, setup)
    spoil_scan(slot, memory.scans[number], robot, setup)
    work_in_scan(
        slot,
        memory,
        memory.scans[number],
        robot,
        scratch.queue[worker],
        clears_footprint=setup.clears_footprint,
    )
    refresh_distances(slot, memory, scratch, worker)
    update_plan(slot, memory, number, scratch, worker, setup.plan_age)
    centre_window(slot, memory, number)
    measure_distances(slot, memory, number, robot, scratch, worker)


@compiled_in_place
def take_scan(
    slot: Slot, memory: Memory, number: int, robot: RobotModel, setup: Conditions
) -> None:
    """Cast the scan that arrives now, and note where the robot believed to be when it was taken.

    A late scan is the scan from where the robot was then: the world stands still, so it is cast
    when it arrives.
    """
    kept = memory.past_poses.shape[1]
    past = memory.past_poses[number, max(slot.tick - setup.scan_delay, 0) % kept]
    x, y, yaw = past[0], past[1], past[2]
    cosine, sine = math.cos(yaw), math.sin(yaw)
    cast_scan(
        memory.scans[number],
        memory.clearance,
        slot.world_offset,
        slot.world_width,
        slot.world_height,
        slot.world_resolution,
        x + cosine * robot.mount_x - sine * robot.mount_y - slot.world_x,
        y + sine * robot.mount_x + cosine * robot.mount_y - slot.world_y,
        yaw + robot.mount_yaw,
        robot.beams,
        robot.range_min,
        robot.range_max,
    )
    slot.scan_x, slot.scan_y, slot.scan_yaw = past[3], past[4], past[5]


@compiled_in_place
def spoil_scan(slot: Slot, ranges: Float32Array, robot: RobotModel, setup: Conditions) -> None:
    """Add noise to a scan (B,) [m] and lose some of its readings."""
    if setup.range_noise > 0.0:
        for beam in range(ranges.shape[0]):
            noisy = ranges[beam] + setup.range_noise * draw_normal(slot)
            ranges[beam] = max(noisy, robot.range_min)
    if setup.range_dropout > 0.0:
        for beam in range(ranges.shape[0]):
            if draw_uniform(slot) < setup.range_dropout:
                ranges[beam] = np.inf
