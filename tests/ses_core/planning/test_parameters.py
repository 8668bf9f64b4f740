"""Planner parameters and what DWA slow and fast set them to."""

import numpy as np

from ses_core.planning.parameters import (
    DWA_FAST,
    DWA_SLOW,
    PARAMETER_NAMES,
    PARAMETER_UNITS,
    initial_parameters,
)
from ses_core.robot_profile import JACKAL, LocalPlannerProfile


def test_fast_differs_from_slow_by_twice_the_speed_and_the_sampling_alone() -> None:
    slow, fast = DWA_SLOW.as_array(), DWA_FAST.as_array()
    changed = {name for name, a, b in zip(PARAMETER_NAMES, slow, fast, strict=True) if a != b}
    assert changed == {"max_vel_x", "vx_samples"}
    assert fast[0] == 2 * slow[0]
    assert fast[2] == 2 * slow[2]


def test_a_robot_begins_with_its_own_weight_of_obstacles() -> None:
    careful = JACKAL.model_copy(update={"planner": LocalPlannerProfile(occdist_scale=0.7)})
    start = initial_parameters(2, careful)
    np.testing.assert_array_equal(start[:, :7], np.tile(DWA_SLOW.as_array()[:7], (2, 1)))
    assert (start[:, PARAMETER_NAMES.index("occdist_scale")] == 0.7).all()


def test_every_parameter_has_a_unit() -> None:
    assert tuple(PARAMETER_UNITS) == PARAMETER_NAMES
