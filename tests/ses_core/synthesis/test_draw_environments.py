"""What is drawn is taken as it is, repaired, or passed over; and how often a draw is asked for."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from numpy.random import Generator, default_rng
from numpy.typing import NDArray

from ses_core.arrays import BoolArray
from ses_core.robot_profile import JACKAL
from ses_core.synthesis.repair import repair
from ses_core.synthesis.sizes import SynthesisPlan
from ses_core.synthesis.synthesize import (
    FittedSynthesis,
    SynthesisResult,
    draw_environments,
    synthesize,
)
from ses_core.synthesis.traversability import traversable
from ses_core.synthesis_settings import (
    GanSettings,
    IdentitySettings,
    SynthesisSettings,
    SynthesizerSettings,
)
from tests.ses_core.synthesis.places import QUICK_SYNTHESIZERS, domain_of, rooms, walled_off

RADIUS = JACKAL.inscribed_radius_m

Uncrossable = Literal["repair", "reject"]


@dataclass
class Source:
    """Hands out given cells; counts what it is asked for."""

    cells: BoolArray
    is_endless: bool
    asked: list[int] = field(default_factory=list)

    def sample(self, count: int, *, rng: Generator, radius: float | None = None) -> BoolArray:
        first = sum(self.asked) if self.is_endless else 0
        self.asked.append(count)
        return self.cells[first : first + count]

    def arrays(self) -> Mapping[str, NDArray[np.generic]]:
        return {"cells": self.cells}


def draw(
    source: Source,
    *,
    environments: int,
    attempts: int = 20,
    uncrossable: Uncrossable = "repair",
    most: int = 30,
    fitted_for: int | None = None,
) -> SynthesisResult:
    return draw_environments(
        FittedSynthesis(
            plan=SynthesisPlan(synthesizer=GanSettings(), environments=fitted_for or environments),
            synthesizer=source,
        ),
        domain_of(rooms(2, seed=9)),
        settings=SynthesisSettings(
            environments=environments,
            attempts=attempts,
            uncrossable=uncrossable,
            most_repaired_cells=most,
        ),
        target=JACKAL,
        rng=default_rng(0),
    )


@pytest.mark.parametrize("uncrossable", ["repair", "reject"])
@pytest.mark.parametrize("synthesizer", QUICK_SYNTHESIZERS, ids=lambda item: item.method)
def test_nothing_that_cannot_be_crossed_is_ever_handed_on(
    synthesizer: SynthesizerSettings, uncrossable: Uncrossable
) -> None:
    places = np.concatenate((rooms(20), walled_off(20), rooms(20, seed=1)))
    result = synthesize(
        domain_of(places),
        settings=SynthesisSettings(
            synthesizer=synthesizer,
            environments=12,
            attempts=2,
            uncrossable=uncrossable,
            most_repaired_cells=200,
        ),
        target=JACKAL,
        rng=default_rng(0),
        progress=lambda _: None,
    )
    cells = result.environments.cells()
    assert traversable(cells, radius=RADIUS).all()
    assert len({place.tobytes() for place in cells}) == len(cells)
    if uncrossable == "repair":
        assert len(cells) > 0
    else:
        assert (result.repaired, result.repaired_cells, result.beyond_repair) == (0, 0.0, 0)


@hypothesis_settings(max_examples=40, deadline=None)
@given(
    order=st.permutations([*range(8)]),
    environments=st.integers(1, 8),
    most=st.integers(1, 8),
    is_endless=st.booleans(),
)
def test_every_sample_that_is_looked_at_is_accounted_for(
    order: list[int], environments: int, most: int, is_endless: bool
) -> None:
    places = np.concatenate((rooms(3), walled_off(4), np.ones((1, 30, 30), dtype=np.bool_)))
    samples = np.concatenate((places, places[:2]))[[*order, 8, 9]]
    source = Source(samples, is_endless)
    result = draw(source, environments=environments, attempts=10, most=most)
    looked_at = samples[: result.drawn]
    can_cross = traversable(looked_at, radius=RADIUS)
    repaired, cleared = repair(looked_at, radius=RADIUS, most=most)
    shipped = result.environments.environments
    assert result.rejected_share == (~can_cross).mean()
    assert result.beyond_repair == (cleared < 0).sum()
    assert result.drawn == len(shipped) + result.repeated + result.beyond_repair
    expected = list(dict.fromkeys(place.tobytes() for place in repaired[cleared >= 0]))
    assert [place.cells.tobytes() for place in shipped] == expected
    assert result.repaired <= (cleared > 0).sum()
    if result.repaired > 0 and result.repeated == 0:
        assert result.repaired_cells == cleared[cleared > 0].mean()


def test_repair_is_a_setting() -> None:
    places = np.concatenate((rooms(1), walled_off(2)))
    repaired = draw(Source(places, is_endless=False), environments=3)
    assert (repaired.repaired, repaired.repaired_cells, repaired.drawn) == (2, 4.0, 3)
    assert repaired.notes == ()
    rejected = draw(Source(places, is_endless=False), environments=3, uncrossable="reject")
    assert (rejected.repaired, rejected.rejected_share) == (0, 2 / 3)
    assert len(rejected.environments.environments) == 1


def test_what_would_need_too_many_changed_cells_is_passed_over_and_said() -> None:
    places = np.concatenate((rooms(1), walled_off(2)))
    result = draw(Source(places, is_endless=False), environments=3, most=3)
    assert len(result.environments.environments) == 1
    assert result.beyond_repair == 2
    assert result.notes == (
        "1 environments instead of 3: among 3 samples 1 can be crossed, "
        "2 would need more than 3 changed cells, 0 repeat another",
    )


def test_a_repaired_place_that_equals_another_is_taken_once_and_traced() -> None:
    closed = rooms(1, seed=9)
    opened = closed.copy()
    closed[0, 29, 14] = True
    result = draw(Source(np.concatenate((closed, opened)), is_endless=False), environments=2)
    assert len(result.environments.environments) == result.repeated == 1
    assert [*result.copies.values()] == ["s0"]


@pytest.mark.parametrize(
    ("blocked", "asked"), [(0, [5]), (1, [5, 5]), (5, [5, 5]), (6, [5, 5, 5]), (90, [5] * 4)]
)
def test_an_endless_source_is_asked_for_no_more_than_is_needed(
    blocked: int, asked: list[int]
) -> None:
    places = np.concatenate((walled_off(blocked), np.unique(rooms(40), axis=0)))
    source = Source(places, is_endless=True)
    draw(source, environments=5, attempts=4, uncrossable="reject")
    assert source.asked == asked


def test_what_is_not_endless_is_asked_once_for_as_many_as_could_be_needed() -> None:
    source = Source(np.concatenate((walled_off(12), rooms(1))), is_endless=False)
    result = draw(source, environments=5, attempts=4, uncrossable="reject")
    assert source.asked == [20]
    assert result.drawn == 13
    assert len(result.environments.environments) == 1


def test_a_recorded_place_is_repaired_too_and_is_no_copy_then() -> None:
    result = synthesize(
        domain_of(walled_off(2)),
        settings=SynthesisSettings(synthesizer=IdentitySettings(), environments=2),
        target=JACKAL,
        rng=default_rng(0),
        progress=lambda _: None,
    )
    assert result.repaired == 2
    assert result.copies == {}


def test_as_many_are_drawn_from_a_training_as_are_wanted_now() -> None:
    source = Source(rooms(60), is_endless=True)
    result = draw(source, environments=9, fitted_for=5)
    assert len(result.environments.environments) == 9
    assert not any("instead of" in note for note in result.notes)
