from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ses_core.errors import ArtifactError
from storage.sealed_json import seal, unseal

SOURCE = Path("entry.json")

values = st.dictionaries(
    st.text(max_size=5).filter(lambda key: key != "sha256"),
    st.one_of(st.none(), st.booleans(), st.integers(), st.text(max_size=5), st.floats(-1e9, 1e9)),
    max_size=4,
)


@given(values)
def test_what_was_sealed_comes_back(value: dict[str, str | int | float | bool | None]) -> None:
    assert unseal(seal(value), source=SOURCE) == value


@given(values, st.data())
def test_any_flipped_bit_is_found_or_changes_nothing(
    value: dict[str, str | int | float | bool | None], data: st.DataObject
) -> None:
    content = bytearray(seal(value))
    bit = data.draw(st.integers(0, 8 * len(content) - 1))
    content[bit // 8] ^= 1 << bit % 8
    try:
        assert unseal(bytes(content), source=SOURCE) == value
    except ArtifactError as error:
        assert "entry.json is damaged" in str(error)  # noqa: PT017  (both ends are allowed)


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"{}", b'"text"', b"\xff\xfe"])
def test_what_was_never_sealed_is_refused(content: bytes) -> None:
    with pytest.raises(ArtifactError, match=r"entry\.json is damaged"):
        unseal(content, source=SOURCE)
