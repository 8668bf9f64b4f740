"""Simulators by name."""

from typing import cast

import pytest

from ses_core.robot_profile import JACKAL
from ses_core.settings import SimulationSettings
from ses_core.simulation.batch import BatchSimulator
from ses_core.simulation.factory import SimulatorName, make_simulator


def test_batch_is_the_batch_simulator() -> None:
    made = make_simulator("batch", slots=3, profile=JACKAL, settings=SimulationSettings())
    assert isinstance(made, BatchSimulator)
    assert made.slots == 3


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(ValueError, match="'gazebo', expected 'batch' or 'bullet'"):
        make_simulator(
            cast("SimulatorName", "gazebo"),
            slots=1,
            profile=JACKAL,
            settings=SimulationSettings(),
        )
