"""move_base's recovery: turn once around on the spot when control or planning has long failed.

Its other recovery, clearing the costmap, does nothing on the Jackal: it clears layers named
`obstacles`, and the Jackal's is named `obstacles_layer`. After the last recovery move_base gives
the goal up and whoever sent it sends it again; here the next failure simply starts over, and an
episode that goes nowhere ends as stuck.
"""

import math

from ses_core.compilation import compiled_in_place
from ses_core.planning.rollouts import HITS, SIM_TIME_S, rollout_cost
from ses_core.simulation.robot import RobotModel
from ses_core.simulation.state import Memory, Slot

CONTROLLER_PATIENCE_S = 15.0
PLANNER_PATIENCE_S = 5.0

_FASTEST = 1.57
_TOLERANCE = 0.157
"""max_vel_theta [rad/s] and yaw_goal_tolerance [rad]: rotate_recovery reads them once, with the
acceleration limit and the slowest turn, from the Jackal's file for TrajectoryPlannerROS."""


@compiled_in_place
def recover(slot: Slot, memory: Memory, number: int, robot: RobotModel, period: float) -> bool:
    """Start or continue the rotate recovery, if it is due, and set its command.

    Returns:
        Whether the recovery commands the robot in this tick.
    """
    if slot.recovery_angle <= 0.0:
        without_control = (slot.tick - slot.control_tick) * period
        # Only a failing controller makes move_base wait for a plan; until then the old one does.
        without_plan = (slot.tick - max(slot.plan_tick, slot.control_tick)) * period
        if without_control <= CONTROLLER_PATIENCE_S and without_plan <= PLANNER_PATIENCE_S:
            return False
        slot.recovery_angle = 2.0 * math.pi - _TOLERANCE
    if _turn_hits(slot, memory, number, robot):
        slot.recovery_angle = 0.0
    else:
        rate = math.sqrt(2.0 * robot.turn_acceleration * (slot.recovery_angle + _TOLERANCE))
        slot.command_v, slot.command_w = (
            0.0,
            min(max(rate, robot.min_in_place_vel_theta), min(_FASTEST, robot.max_turn_rate)),
        )
        slot.recovery_angle -= abs(slot.w) * period
    if slot.recovery_angle <= 0.0:
        slot.recovery_angle = 0.0
        slot.control_tick, slot.plan_tick = slot.tick, slot.tick
        slot.command_v, slot.command_w = 0.0, 0.0
    return True


@compiled_in_place
def _turn_hits(slot: Slot, memory: Memory, number: int, robot: RobotModel) -> bool:
    """Tell whether the padded outline would meet a lethal cell up to where the turn began."""
    rest = slot.recovery_angle + _TOLERANCE
    cost = rollout_cost(slot, memory, number, robot, 0.0, rest / SIM_TIME_S, False, math.inf)
    return cost == HITS
