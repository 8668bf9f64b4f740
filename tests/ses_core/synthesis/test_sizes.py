import pytest

from ses_core.errors import SynthesisError
from ses_core.synthesis.sizes import plan_synthesis
from ses_core.synthesis_settings import (
    GanSettings,
    IdentitySettings,
    PcaSettings,
    RandomSamplingSettings,
    SynthesisSettings,
    SynthesizerSettings,
)

ALL = (GanSettings(), PcaSettings(), RandomSamplingSettings(), IdentitySettings())


def settings(synthesizer: SynthesizerSettings) -> SynthesisSettings:
    return SynthesisSettings(synthesizer=synthesizer, environments=100)


@pytest.mark.parametrize("synthesizer", ALL, ids=lambda item: item.method)
def test_nothing_to_learn_from_is_refused(synthesizer: SynthesizerSettings) -> None:
    with pytest.raises(SynthesisError, match="no challenging environment"):
        plan_synthesis(settings(synthesizer), available=0)


@pytest.mark.parametrize(
    ("synthesizer", "used"),
    [
        (GanSettings(), "identity"),
        (PcaSettings(), "identity"),
        (RandomSamplingSettings(), "rs"),
        (IdentitySettings(), "identity"),
    ],
)
def test_one_environment_is_copied_whatever_was_asked(
    synthesizer: SynthesizerSettings, used: str
) -> None:
    plan = plan_synthesis(settings(synthesizer), available=1)
    assert plan.synthesizer.method == used
    assert plan.environments == 1


def test_gan_with_fewer_than_its_least_environments_says_that_it_copies() -> None:
    plan = plan_synthesis(settings(GanSettings()), available=29)
    assert plan.synthesizer.method == "identity"
    assert plan.environments == 29
    assert plan.notes[0].startswith("identity instead of gan: 29 environments")


def test_gan_with_its_least_environments_makes_as_many_as_were_asked_for() -> None:
    plan = plan_synthesis(settings(GanSettings()), available=30)
    assert (plan.synthesizer.method, plan.environments, plan.notes) == ("gan", 100, ())


@pytest.mark.parametrize(("available", "components"), [(2, 1), (100, 99), (101, 100), (300, 100)])
def test_pca_keeps_fewer_components_than_there_are_environments(
    available: int, components: int
) -> None:
    plan = plan_synthesis(settings(PcaSettings()), available=available)
    assert isinstance(plan.synthesizer, PcaSettings)
    assert plan.synthesizer.components == components
    assert plan.synthesizer.per_cluster == PcaSettings().per_cluster
    assert any("principal components" in note for note in plan.notes) == (components < 100)


@pytest.mark.parametrize("synthesizer", ALL[1:], ids=lambda item: item.method)
@pytest.mark.parametrize(("available", "shipped"), [(99, 99), (100, 100), (101, 100)])
def test_fewer_than_asked_for_are_never_repeated_and_said_so(
    synthesizer: SynthesizerSettings, available: int, shipped: int
) -> None:
    plan = plan_synthesis(settings(synthesizer), available=available)
    assert plan.environments == shipped
    assert any("never repeats" in note for note in plan.notes) == (available < 100)
