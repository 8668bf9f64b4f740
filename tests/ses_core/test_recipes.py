"""Keys: what changes them and what does not."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ses_core.recipes import (
    ArtifactRef,
    Recipe,
    Stage,
    canonical_json,
    digest_json,
    parse_ref,
    settings_json,
)
from ses_core.settings import ExtractionSettings, Settings

STAGE = Stage("scenarios", 1)
refs = st.lists(
    st.builds(
        ArtifactRef, st.sampled_from(["log", "fit"]), st.text("0123456789abcdef", min_size=8)
    ),
    min_size=2,
    max_size=5,
    unique=True,
)


@given(refs)
def test_the_order_of_a_set_of_inputs_does_not_matter(inputs: list[ArtifactRef]) -> None:
    forward = Recipe(STAGE, input_set=frozenset(inputs))
    backward = Recipe(STAGE, input_set=frozenset(reversed(inputs)))
    assert forward.key() == backward.key()


@given(refs)
def test_the_order_of_a_list_of_inputs_does_matter(inputs: list[ArtifactRef]) -> None:
    forward = Recipe(STAGE, inputs=tuple(inputs))
    backward = Recipe(STAGE, inputs=tuple(reversed(inputs)))
    assert forward.key() != backward.key()


def test_stage_version_settings_and_inputs_each_change_the_key() -> None:
    base = Recipe(STAGE, {"distance_m": 5.0})
    ref = ArtifactRef("log", "00")
    others = [
        Recipe(Stage("scenarios", 2), {"distance_m": 5.0}),
        Recipe(Stage("filter", 1), {"distance_m": 5.0}),
        Recipe(STAGE, {"distance_m": 4.5}),
        Recipe(STAGE, {"distance_m": 5.0}, inputs=(ref,)),
        Recipe(STAGE, {"distance_m": 5.0}, input_set=frozenset({ref})),
    ]
    assert len({recipe.key() for recipe in (base, *others)}) == 6


def test_equal_settings_give_equal_keys_however_they_were_built() -> None:
    read = Settings.model_validate_json(Settings().model_dump_json())
    assert digest_json(settings_json(read)) == digest_json(settings_json(Settings()))
    other = settings_json(ExtractionSettings(distance_m=4.5))
    assert digest_json(other) != digest_json(settings_json(ExtractionSettings()))


def test_canonical_json_sorts_keys_and_refuses_what_is_not_json() -> None:
    assert canonical_json({"b": 1, "a": [True, None]}) == '{"a":[true,null],"b":1}'
    with pytest.raises(ValueError, match="JSON"):
        canonical_json(float("nan"))


def test_a_reference_reads_back_from_its_text() -> None:
    ref = ArtifactRef("log", "ab12")
    assert parse_ref(str(ref)) == ref
    with pytest.raises(ValueError, match="kind/digest"):
        parse_ref("ab12")
