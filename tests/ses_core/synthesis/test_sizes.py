import itertools
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter

from ses_core.errors import SynthesisError
from ses_core.synthesis import sizes
from ses_core.synthesis.sizes import SynthesisPlan, plan_synthesis
from ses_core.synthesis_settings import (
    GanSettings,
    IdentitySettings,
    MirrorSettings,
    PcaPaperSettings,
    PcaSettings,
    RandomSamplingSettings,
    SynthesisSettings,
    SynthesizerSettings,
)

ALL: tuple[SynthesizerSettings, ...] = tuple(
    kind() for kind in get_args(get_args(SynthesizerSettings)[0])
)
PCAS = (PcaSettings(), PcaPaperSettings())


def plan(synthesizer: SynthesizerSettings, available: int, asked: int = 100) -> SynthesisPlan:
    settings = SynthesisSettings(synthesizer=synthesizer, environments=asked)
    return plan_synthesis(settings, available=available)


def described(synthesizer: SynthesizerSettings, available: int) -> str:
    """Say what the plan is, in the words of the table."""
    try:
        found = plan(synthesizer, available)
    except SynthesisError:
        return "refused"
    words = str(found.environments)
    if found.synthesizer.method != synthesizer.method:
        words += f" by {found.synthesizer.method}"
    elif (
        isinstance(found.synthesizer, PcaSettings | PcaPaperSettings)
        and found.synthesizer != synthesizer
    ):
        words += f" of {found.synthesizer.components} components"
    return words


def table() -> dict[tuple[str, int], str]:
    """Read the table in the module's documentation: method and N to what is done."""
    lines = [line for line in str(sizes.__doc__).splitlines() if line.startswith("|")]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    header, _, *body = rows
    return {
        (method.strip(), int(row[0])): cell
        for row in body
        for methods, cell in zip(header[1:], row[1:], strict=True)
        for method in methods.split(",")
    }


@pytest.mark.parametrize("synthesizer", ALL, ids=lambda item: item.method)
@pytest.mark.parametrize("available", [0, 1, 5, 30, 99, 300])
def test_the_table_says_what_is_done(synthesizer: SynthesizerSettings, available: int) -> None:
    assert described(synthesizer, available) == table()[synthesizer.method, available]


def test_the_table_has_all_nine_methods_and_six_numbers() -> None:
    methods = {synthesizer.method for synthesizer in ALL}
    assert len(methods) == 9
    assert set(table()) == set(itertools.product(methods, [0, 1, 5, 30, 99, 300]))


@given(
    synthesizer=st.sampled_from(ALL),
    available=st.integers(1, 400),
    asked=st.integers(1, 400),
)
def test_nothing_is_done_otherwise_than_asked_without_a_note(
    synthesizer: SynthesizerSettings, available: int, asked: int
) -> None:
    found = plan(synthesizer, available, asked)
    assert found.environments <= asked
    assert len(found.notes) == (found.synthesizer != synthesizer) + (found.environments != asked)
    if found.environments != asked:
        assert f"{found.environments} environments instead of {asked}" in found.notes[-1]
    if found.synthesizer.method != synthesizer.method:
        replaced = f"{found.synthesizer.method} instead of {synthesizer.method}"
        assert found.notes[0].startswith(replaced)
        assert f"{available} environments to learn from" in found.notes[0]


@pytest.mark.parametrize("synthesizer", ALL, ids=lambda item: item.method)
def test_nothing_to_learn_from_is_refused(synthesizer: SynthesizerSettings) -> None:
    with pytest.raises(SynthesisError, match="no challenging environment"):
        plan(synthesizer, 0)


@pytest.mark.parametrize("synthesizer", ALL, ids=lambda item: item.method)
def test_a_plan_of_a_plan_is_that_plan(synthesizer: SynthesizerSettings) -> None:
    for available in (1, 5, 99):
        once = plan(synthesizer, available)
        assert plan(once.synthesizer, available, once.environments).notes == ()


def test_a_generator_is_replaced_below_its_own_least_number() -> None:
    synthesizer = GanSettings(least_environments=50)
    assert plan(synthesizer, 49).synthesizer == MirrorSettings()
    assert plan(synthesizer, 49).notes == (
        "mirror instead of gan: 49 environments to learn from, gan needs 50",
    )
    assert plan(synthesizer, 50).synthesizer == synthesizer


@pytest.mark.parametrize(("available", "shipped"), [(24, 96), (25, 100), (26, 100)])
def test_mirror_offers_four_courses_of_every_place(available: int, shipped: int) -> None:
    assert plan(MirrorSettings(), available).environments == shipped


@pytest.mark.parametrize("synthesizer", PCAS, ids=lambda item: item.method)
@pytest.mark.parametrize(("available", "components"), [(2, 1), (100, 99), (101, 100), (300, 100)])
def test_pca_keeps_fewer_components_than_there_are_environments(
    synthesizer: PcaSettings | PcaPaperSettings, available: int, components: int
) -> None:
    expected = synthesizer.model_copy(update={"components": components})
    found = plan(synthesizer, available)
    assert found.synthesizer == expected
    assert any("principal components" in note for note in found.notes) == (components < 100)


def test_there_are_no_more_components_than_cells() -> None:
    found = plan(PcaSettings(components=1000), 3769)
    assert found.synthesizer == PcaSettings(components=900)
    assert found.notes[0].startswith("900 principal components instead of 1000")


@pytest.mark.parametrize("synthesizer", PCAS, ids=lambda item: item.method)
def test_a_single_place_spans_no_component_and_is_copied(
    synthesizer: PcaSettings | PcaPaperSettings,
) -> None:
    assert plan(synthesizer, 1).synthesizer == IdentitySettings()


@pytest.mark.parametrize(("available", "shipped"), [(99, 99), (100, 100), (101, 100)])
def test_fewer_than_asked_for_are_never_repeated_and_said_so(available: int, shipped: int) -> None:
    found = plan(RandomSamplingSettings(), available)
    assert found.environments == shipped
    assert any("never repeats" in note for note in found.notes) == (available < 100)


def test_what_is_planned_is_valid_settings() -> None:
    adapter: TypeAdapter[SynthesizerSettings] = TypeAdapter(SynthesizerSettings)
    for synthesizer, available in itertools.product(ALL, [1, 2, 5, 30]):
        planned = plan(synthesizer, available).synthesizer
        assert adapter.validate_python(planned.model_dump()) == planned
