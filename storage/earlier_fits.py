"""A warm start: which earlier fit a fit goes on from, and that fit read back."""

from dataclasses import replace

from ses_core.errors import ArtifactError
from ses_core.recipes import ArtifactRef, JsonValue, Recipe, parse_ref, settings_json
from ses_core.synthesis.synthesize import EarlierFit
from storage.artifact_store import Answer, LocalArtifactStore
from storage.stages import FIT
from storage.synthesizer_files import read_synthesizer

_SHOWN_DIGITS = 12


def go_on(recipe: Recipe, *, store: LocalArtifactStore, anew: bool = False) -> Recipe:
    """Make the earlier fit that a fit goes on from an input of its recipe.

    What was fitted to these environments already is not fitted again, whatever it went on from.
    Else it is the newest fit of the same synthesizer, to other environments or with another seed.

    Args:
        recipe: Asks for a fit from nothing.
        store: Where fits are kept.
        anew: Fit again although it was done already.

    Returns:
        The recipe with at most one input; without any where there is no earlier fit.
    """
    answers = store.answers(FIT)
    asked = dict(recipe.settings)
    if not anew:
        for answer in answers:
            if answer.recipe["settings"] == asked:
                known = replace(recipe, inputs=_inputs(answer))
                if store.find(known) is not None:
                    return known
    for answer in answers:
        if answer.recipe["settings"] != asked and _is_fit_by(
            asked["synthesizer"], answer, store=store
        ):
            return replace(recipe, inputs=(answer.ref,))
    return recipe


def earlier_fit(recipe: Recipe, *, store: LocalArtifactStore) -> EarlierFit | None:
    """Read the fit that a recipe goes on from, or None where it begins from nothing.

    Raises:
        ArtifactError: It is missing or damaged.
    """
    if not recipe.inputs:
        return None
    ref = recipe.inputs[0]
    return EarlierFit(name=ref.digest[:_SHOWN_DIGITS], fitted=read_synthesizer(store.path(ref)))


def _inputs(answer: Answer) -> tuple[ArtifactRef, ...]:
    inputs = answer.recipe["inputs"]
    assert isinstance(inputs, list)
    return tuple(parse_ref(str(ref)) for ref in inputs)


def _is_fit_by(synthesizer: JsonValue, answer: Answer, *, store: LocalArtifactStore) -> bool:
    """Tell whether a fit is there and was made by a synthesizer, not by what stood in for it."""
    settings = answer.recipe["settings"]
    assert isinstance(settings, dict)
    if settings.get("synthesizer") != synthesizer:
        return False
    try:
        fitted = read_synthesizer(store.path(answer.ref))
    except ArtifactError:
        return False
    return settings_json(fitted.plan.synthesizer) == synthesizer
