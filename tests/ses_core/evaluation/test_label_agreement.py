"""Tests of label agreement, against scipy's correlation and a count of all pairs."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import spearmanr

from ses_core.evaluation.label_agreement import (
    agreement_by_group,
    area_under_curve,
    label_agreement,
    rank_correlation,
)

COUNTS = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=3, max_size=20)


@given(pairs=COUNTS)
def test_correlation_is_spearmans_with_ties(pairs: list[tuple[int, int]]) -> None:
    first, second = np.array(pairs, dtype=np.float64).T
    found = rank_correlation(first, second)
    if len(set(first)) == 1 or len(set(second)) == 1:
        assert found is None
    else:
        assert found == pytest.approx(spearmanr(first, second).statistic)


@given(pairs=COUNTS)
def test_auc_is_the_share_of_pairs_in_the_right_order(pairs: list[tuple[int, int]]) -> None:
    first, scores = np.array(pairs, dtype=np.float64).T
    is_positive = first > 4
    wins = [
        1.0 if one > other else 0.5 if one == other else 0.0
        for one, other in itertools.product(scores[is_positive], scores[~is_positive])
    ]
    found = area_under_curve(is_positive, scores)
    assert found == (pytest.approx(np.mean(wins)) if wins else None)


def test_hard_again_is_strictly_above_the_same_threshold() -> None:
    logged = np.array([50.0, 51.0, 80.0, 99.0])
    found = label_agreement(logged, np.array([99.0, 50.0, 51.0, 80.0]), threshold=50.0)
    assert (found.places, found.challenging) == (4, 3)
    assert found.hard_again == pytest.approx(2 / 3)


def test_where_nothing_is_known_nothing_is_said() -> None:
    found = label_agreement(np.zeros(0), np.zeros(0), threshold=50.0)
    assert (found.places, found.challenging) == (0, 0)
    assert (found.correlation, found.hard_again, found.auc) == (None, None, None)
    alike = label_agreement(np.array([60.0, 70.0]), np.array([60.0, 70.0]), threshold=50.0)
    assert (alike.correlation, alike.hard_again, alike.auc) == (None, 1.0, None)


def test_groups_are_compared_by_themselves_and_named_in_order() -> None:
    logged, simulated = np.arange(6.0), np.array([0.0, 9.0, 1.0, 8.0, 2.0, 7.0])
    found = agreement_by_group(logged, simulated, ["b", "a"] * 3, threshold=1.0)
    assert list(found) == ["a", "b"]
    assert found["b"].correlation == pytest.approx(1.0)
    assert found["a"].correlation == pytest.approx(-1.0)
    assert {name: one.places for name, one in found.items()} == {"a": 3, "b": 3}
