"""What is challenging, and BARN's measures of drawn places."""

import numpy as np
import pytest

from ses_core.extraction.difficulty import (
    CountKind,
    count_of,
    is_challenging,
    measure_difficulty,
)
from ses_core.extraction.scenario import Scenario
from ses_core.geometry import Pose2D
from ses_core.robot_profile import JACKAL
from ses_core.settings import FilterSettings

RADIUS = JACKAL.inscribed_radius_m


def scenario(count: int | None, *, kind: str = "scenario") -> Scenario:
    return Scenario(
        kind="scenario" if kind == "scenario" else "terminal",
        first_step=0,
        last_step=200,
        start_stamp_ns=0,
        duration_s=10.0,
        arc_length_m=6.0,
        start=Pose2D(0.0, 0.0),
        goal=(5.1, 0.0),
        negative_velocity_count=count,
        not_forward_count=None if count is None else count + 30,
        reversing_s=None if count is None else count / 20,
    )


def test_fifty_is_not_challenging_and_fifty_one_is() -> None:
    settings = FilterSettings()
    assert not is_challenging(scenario(50), settings)
    assert is_challenging(scenario(51), settings)


def test_unknown_counts_and_terminal_segments_are_never_challenging() -> None:
    settings = FilterSettings(threshold=0.0)
    assert not is_challenging(scenario(None), settings)
    assert not is_challenging(scenario(500, kind="terminal"), settings)
    assert not is_challenging(scenario(0), settings)


@pytest.mark.parametrize(
    ("kind", "expected"), [("negative", 40), ("not-forward", 70), ("reversing-seconds", 2.0)]
)
def test_the_kind_names_the_count(kind: CountKind, expected: float) -> None:
    assert count_of(scenario(40), kind) == expected
    assert count_of(scenario(None), kind) is None
    settings = FilterSettings(count_kind=kind, threshold=expected)
    assert not is_challenging(scenario(40), settings)
    assert is_challenging(scenario(41), settings)


def test_an_empty_place_is_as_open_as_it_is_wide() -> None:
    measures = measure_difficulty(np.zeros((30, 30), dtype=np.bool_), radius=RADIUS)
    assert measures is not None
    assert measures.closest_obstacle == pytest.approx(2.5 - RADIUS, abs=1e-6)
    assert measures.characteristic_dimension == pytest.approx(5.0 - 2 * RADIUS, abs=0.05)
    assert measures.dispersion == 0.0
    assert measures.tortuosity == pytest.approx(1.0)


def test_a_corridor_is_as_wide_as_it_is() -> None:
    cells = np.ones((30, 30), dtype=np.bool_)
    cells[:, 12:18] = False
    measures = measure_difficulty(cells, radius=RADIUS)
    assert measures is not None
    # In the configuration space a corridor of 1 m is 0.47 m wide for a disc of 0.265 m.
    assert measures.closest_obstacle == pytest.approx(0.5 - RADIUS, abs=0.01)
    assert measures.characteristic_dimension == pytest.approx(1.0 - 2 * RADIUS, abs=0.05)
    assert measures.dispersion == pytest.approx(4.0, abs=0.5)


def test_measures_tell_cluttered_places_from_open_ones() -> None:
    open_place = np.zeros((30, 30), dtype=np.bool_)
    cluttered = open_place.copy()
    cluttered[4:26:7, 2:29:7] = True
    slalom = open_place.copy()
    slalom[10, :20] = True
    slalom[20, 10:] = True
    easy, hard, winding = (
        measure_difficulty(cells, radius=RADIUS) for cells in (open_place, cluttered, slalom)
    )
    assert easy is not None
    assert hard is not None
    assert winding is not None
    assert hard.closest_obstacle < easy.closest_obstacle
    assert hard.visibility < easy.visibility
    assert hard.dispersion > easy.dispersion
    assert hard.characteristic_dimension < easy.characteristic_dimension
    assert winding.tortuosity > 1.2 > easy.tortuosity


def test_a_mirrored_place_is_equally_hard() -> None:
    rng = np.random.default_rng(1)
    cells = rng.random((30, 30)) < 0.01
    cells[:3] = cells[-3:] = False
    measures = measure_difficulty(cells, radius=RADIUS)
    mirrored = measure_difficulty(cells[:, ::-1].copy(), radius=RADIUS)
    assert measures is not None
    assert mirrored is not None
    assert mirrored.tortuosity == pytest.approx(measures.tortuosity, abs=0.01)
    assert mirrored.visibility == pytest.approx(measures.visibility, rel=0.1)


def test_a_place_that_cannot_be_crossed_has_no_measures() -> None:
    assert measure_difficulty(np.ones((30, 30), dtype=np.bool_), radius=RADIUS) is None
