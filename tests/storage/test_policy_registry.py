from pathlib import Path

import pytest

from ses_core.errors import ArtifactError
from ses_core.recipes import ArtifactRef
from storage.layout import open_layout
from storage.policy_registry import PolicyRegistry, RegistryEntry

A, B, C = (ArtifactRef("train", letter * 64) for letter in "abc")


@pytest.fixture
def registry(tmp_path: Path) -> PolicyRegistry:
    return PolicyRegistry(open_layout(tmp_path))


def promote(registry: PolicyRegistry, ref: ArtifactRef) -> RegistryEntry:
    return registry.promote(ref, policy_id=ref.digest[0], run_id="night", reason="better")


def champion(registry: PolicyRegistry) -> ArtifactRef | None:
    entry = registry.champion()
    return entry.policy if entry else None


def test_nobody_is_champion_until_one_is_promoted(registry: PolicyRegistry) -> None:
    assert registry.champion() is None
    assert registry.history() == []
    with pytest.raises(ArtifactError, match="no champion to roll back"):
        registry.rollback(reason="why not")
    assert registry.history() == []


def test_rolling_back_walks_back_through_the_promotions(registry: PolicyRegistry) -> None:
    for ref in (A, B, C):
        promote(registry, ref)
    seen = []
    for _ in range(3):
        registry.rollback(reason="worse in the yard")
        seen.append(champion(registry))
    assert seen == [B, A, None]
    with pytest.raises(ArtifactError, match="no champion"):
        registry.rollback(reason="again")
    assert [entry.action for entry in registry.history()] == ["promote"] * 3 + ["rollback"] * 3


def test_a_promotion_after_a_rollback_goes_back_to_what_it_took_over_from(
    registry: PolicyRegistry,
) -> None:
    promote(registry, A)
    promote(registry, B)
    registry.rollback(reason="worse")
    promote(registry, C)
    registry.rollback(reason="worse too")
    assert champion(registry) == A
    assert registry.history()[-1].policy_id == "a"


def test_a_first_promotion_after_an_empty_throne_rolls_back_to_it(
    registry: PolicyRegistry,
) -> None:
    promote(registry, A)
    registry.rollback(reason="bad")
    promote(registry, B)
    registry.rollback(reason="bad")
    assert registry.champion() is None


def test_promoting_the_champion_again_changes_nothing(registry: PolicyRegistry) -> None:
    first = promote(registry, A)
    assert promote(registry, A) == first
    assert len(registry.history()) == 1


def test_another_process_sees_the_same_history(tmp_path: Path) -> None:
    entry = promote(PolicyRegistry(open_layout(tmp_path)), A)
    assert PolicyRegistry(open_layout(tmp_path)).champion() == entry
