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

_ACCELERATION = 3.2
_SLOWEST = 0.4
_FASTEST = 1.0
"""rotate_recovery's defaults [rad/s^2, rad/s]: it reads names the Jackal's files do not set."""


@compiled_in_place
def recover(slot: Slot, memory: Memory, number: int, robot: RobotModel, period: float) -> bool:
    """Start or continue the rotate recovery, if it is due, and set its command.

    Returns:
        Whether the recovery commands the robot in this tick.
    """
    if slot.recovery_angle <= 0.0:
        without_control = (slot.tick - slot.control_tick) * period
        without_plan = (slot.tick - slot.plan_tick) * period
        if without_control <= CONTROLLER_PATIENCE_S and without_plan <= PLANNER_PATIENCE_S:
            return False
        slot.recovery_angle = 2.0 * math.pi
    if _turn_hits(slot, memory, number, robot):
        slot.recovery_angle = 0.0
    else:
        rate = math.sqrt(2.0 * _ACCELERATION * slot.recovery_angle)
        slot.command_v, slot.command_w = 0.0, min(max(rate, _SLOWEST), _FASTEST)
        slot.recovery_angle -= abs(slot.w) * period
    if slot.recovery_angle <= 0.0:
        slot.recovery_angle = 0.0
        slot.control_tick, slot.plan_tick = slot.tick, slot.tick
        slot.command_v, slot.command_w = 0.0, 0.0
    return True


@compiled_in_place
def _turn_hits(slot: Slot, memory: Memory, number: int, robot: RobotModel) -> bool:
    """Tell whether the padded outline would meet a lethal cell during the rest of the turn."""
    cost = rollout_cost(
        slot, memory, number, robot, 0.0, slot.recovery_angle / SIM_TIME_S, False, math.inf
    )
    return cost == HITS
