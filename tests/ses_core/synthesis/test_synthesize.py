import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from numpy.random import default_rng

from ses_core.arrays import BoolArray
from ses_core.errors import SynthesisError
from ses_core.robot_profile import JACKAL, RASPIMOUSE
from ses_core.synthesis.mirror import four_courses
from ses_core.synthesis.synthesize import SynthesisResult, synthesize
from ses_core.synthesis.traversability import traversable
from ses_core.synthesis_settings import (
    GanSettings,
    IdentitySettings,
    MedoidsSettings,
    MirrorSettings,
    PcaSettings,
    RandomSamplingSettings,
    SynthesisSettings,
    SynthesizerSettings,
)
from tests.ses_core.synthesis.places import QUICK_SYNTHESIZERS, domain_of, rooms, walled_off

COPIERS: tuple[SynthesizerSettings, ...] = (
    RandomSamplingSettings(),
    MedoidsSettings(),
    IdentitySettings(),
)


RECORDED: tuple[SynthesizerSettings, ...] = (*COPIERS, MirrorSettings(), PcaSettings())
"""What hands out recorded places, as they are or the other way round."""


def run(
    cells: BoolArray, synthesizer: SynthesizerSettings, *, environments: int = 10, seed: int = 0
) -> SynthesisResult:
    return synthesize(
        domain_of(cells),
        settings=SynthesisSettings(
            synthesizer=synthesizer, environments=environments, uncrossable="reject"
        ),
        target=JACKAL,
        rng=default_rng(seed),
        progress=lambda _: None,
    )


@pytest.mark.parametrize(
    "synthesizer",
    QUICK_SYNTHESIZERS,
    ids=lambda item: item.method,
)
def test_only_distinct_environments_that_the_target_can_cross_are_handed_on(
    synthesizer: SynthesizerSettings,
) -> None:
    mixed = np.concatenate((rooms(30), walled_off(30), rooms(30)))
    result = run(mixed, synthesizer, environments=40)
    cells = result.environments.cells()
    assert traversable(cells, radius=JACKAL.inscribed_radius_m).all()
    assert len({place.tobytes() for place in cells}) == len(cells)
    assert len({item.environment_id for item in result.environments.environments}) == len(cells)
    if len(cells) < 40:
        assert any(f"{len(cells)} environments instead of 40" in note for note in result.notes)


@given(
    crossable=st.integers(0, 12),
    blocked=st.integers(0, 12),
    asked=st.integers(1, 15),
    synthesizer=st.sampled_from(COPIERS),
)
@hypothesis_settings(max_examples=25, deadline=None)
def test_copies_fill_up_to_what_can_be_crossed(
    crossable: int, blocked: int, asked: int, synthesizer: SynthesizerSettings
) -> None:
    if crossable + blocked == 0:
        return
    cells = np.concatenate((rooms(crossable), walled_off(blocked)))
    distinct = len({place.tobytes() for place in cells[:crossable]})
    result = run(cells, synthesizer, environments=asked)
    assert len(result.environments.environments) == min(asked, distinct)
    assert 0.0 <= result.rejected_share <= blocked / result.drawn
    assert len(result.copies) == len(result.environments.environments)


def test_identity_copies_the_hardest_first_and_passes_over_what_cannot_be_crossed() -> None:
    places = rooms(5, seed=4)
    cells = np.concatenate((places[:2], walled_off(1), places[2:]))
    result = run(cells, IdentitySettings(), environments=3)
    assert np.array_equal(result.environments.cells(), places[:3])
    assert (result.drawn, result.rejected_share) == (4, 0.25)
    assert list(result.copies.values()) == ["s0", "s1", "s3"]


def test_a_place_recorded_twice_is_trained_in_once() -> None:
    places = rooms(3, seed=1)
    result = run(np.concatenate((places, places)), IdentitySettings(), environments=6)
    assert len(result.environments.environments) == 3
    assert result.repeated == 3
    assert "3 environments instead of 6" in result.notes[-1]


def test_environments_are_marked_with_their_synthesizer_and_with_no_scenario() -> None:
    result = run(rooms(4), RandomSamplingSettings(), environments=4)
    for environment in result.environments.environments:
        assert environment.origin == "rs"
        assert environment.scenario_id == ""
        assert environment.observed.all()
        assert len(environment.environment_id) == 16


def test_fall_back_is_recorded() -> None:
    places = rooms(5)
    result = run(places, GanSettings(), environments=100)
    assert (result.method_asked, result.method_used) == ("gan", "mirror")
    assert result.notes[0].startswith("mirror instead of gan")
    assert result.notes[1].startswith("20 environments instead of 100")
    assert {item.origin for item in result.environments.environments} == {"mirror"}
    assert len(result.environments.environments) == len(np.unique(four_courses(places), axis=0))
    assert sorted(result.copies.values()) == ["s0", "s1", "s2", "s3", "s4"]


@pytest.mark.parametrize("synthesizer", RECORDED, ids=lambda item: item.method)
@pytest.mark.parametrize("available", [1, 5, 30, 99, 300])
def test_what_can_be_crossed_is_as_many_as_the_table_says(
    synthesizer: SynthesizerSettings, available: int
) -> None:
    places = np.unique(rooms(500), axis=0)[:available]
    assert len(places) == available
    result = run(places, synthesizer, environments=100)
    offered = four_courses(places) if result.method_used == "mirror" else places
    shipped = len(result.environments.environments)
    assert shipped == min(100, len(np.unique(offered, axis=0)))
    if shipped < 100:
        assert result.notes[-1].startswith(f"{shipped} environments instead of")


def test_nothing_that_can_be_crossed_hands_on_nothing_and_says_so() -> None:
    result = run(walled_off(6), RandomSamplingSettings(), environments=6)
    assert result.environments.environments == ()
    assert result.rejected_share == 1.0
    assert "0 environments instead of 6" in result.notes[-1]


def test_a_smaller_target_crosses_more() -> None:
    narrow = rooms(1)
    narrow[0, 14:16] = True
    narrow[0, 14:16, 14:16] = False
    domain = domain_of(narrow)
    settings = SynthesisSettings(
        synthesizer=IdentitySettings(), environments=1, uncrossable="reject"
    )
    shipped = [
        len(
            synthesize(
                domain,
                settings=settings,
                target=target,
                rng=default_rng(0),
                progress=lambda _: None,
            ).environments.environments
        )
        for target in (JACKAL, RASPIMOUSE)
    ]
    assert shipped == [0, 1]


def test_same_seed_gives_the_same_environments_and_another_seed_others() -> None:
    cells = rooms(40)
    first, again, other = (
        run(cells, RandomSamplingSettings(), seed=seed).environments for seed in (0, 0, 1)
    )
    assert [item.environment_id for item in first.environments] == [
        item.environment_id for item in again.environments
    ]
    assert not np.array_equal(first.cells(), other.cells())


def test_an_empty_domain_is_refused() -> None:
    with pytest.raises(SynthesisError):
        run(rooms(0), RandomSamplingSettings())
