"""Simulators by name."""

from typing import Literal

from ses_core.protocols import Simulator
from ses_core.robot_profile import RobotProfile
from ses_core.settings import SimulationSettings

SimulatorName = Literal["batch", "bullet"]


def make_simulator(
    name: SimulatorName, *, slots: int, profile: RobotProfile, settings: SimulationSettings
) -> Simulator:
    """Make the simulator of that name with N slots.

    Raises:
        ValueError: There is no simulator of that name.
    """
    if name == "batch":
        from ses_core.simulation.batch import BatchSimulator

        return BatchSimulator(slots=slots, profile=profile, settings=settings)
    if name == "bullet":
        from ses_core.simulation.bullet import BulletSimulator

        return BulletSimulator(slots=slots, profile=profile, settings=settings)
    raise ValueError(f"no simulator is named {name!r}, expected 'batch' or 'bullet'")
