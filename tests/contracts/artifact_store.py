"""What every artifact store must do."""

from collections.abc import Callable
from pathlib import Path

import pytest

from ses_core.errors import ArtifactError
from ses_core.protocols import ArtifactStore
from ses_core.recipes import ArtifactRef, Recipe, Stage

_STAGE = Stage("contract", 1)


class BuildError(Exception):
    """A build that went wrong."""


def check_artifact_store(store: ArtifactStore) -> None:
    """Check a store that holds nothing yet."""
    _answers_only_what_was_put(store)
    _builds_once(store)
    _names_artifacts_by_their_content(store)
    _keeps_nothing_of_a_failed_build(store)
    _refuses_what_it_does_not_have(store)


def _answers_only_what_was_put(store: ArtifactStore) -> None:
    asked = Recipe(_STAGE, {"number": 1})
    assert store.find(asked) is None
    ref = store.put(asked, _write("one"))
    assert store.find(asked) == ref
    assert store.find(Recipe(_STAGE, {"number": 2})) is None
    assert store.find(Recipe(Stage("contract", 2), {"number": 1})) is None
    assert (store.path(ref) / "below" / "text").read_text() == "one"


def _builds_once(store: ArtifactStore) -> None:
    asked = Recipe(_STAGE, {"number": "once"})
    first = store.put(asked, _write("first"))
    assert store.put(asked, _fail) == first


def _names_artifacts_by_their_content(store: ArtifactStore) -> None:
    same = [store.put(Recipe(_STAGE, {"same": k}), _write("same")) for k in range(2)]
    assert same[0] == same[1]
    assert store.put(Recipe(_STAGE, {"same": 2}), _write("other")) != same[0]


def _keeps_nothing_of_a_failed_build(store: ArtifactStore) -> None:
    asked = Recipe(_STAGE, {"number": "failing"})
    with pytest.raises(BuildError):
        store.put(asked, _fail)
    assert store.find(asked) is None
    assert (store.path(store.put(asked, _write("now"))) / "below" / "text").read_text() == "now"


def _refuses_what_it_does_not_have(store: ArtifactStore) -> None:
    with pytest.raises(ArtifactError, match="missing"):
        store.path(ArtifactRef("contract", "0" * 64))


def _write(text: str) -> Callable[[Path], None]:
    def build(folder: Path) -> None:
        (folder / "below").mkdir()
        (folder / "below" / "text").write_text(text)

    return build


def _fail(folder: Path) -> None:
    (folder / "half").write_text("half")
    raise BuildError
