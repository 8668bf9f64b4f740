import numpy as np
import pytest

from ses_core.scorecard.halving import Grouping, coarsest_grouping, halvings
from tests.ses_core.scorecard.samples import sites


def test_halves_share_no_site_and_have_one_size() -> None:
    grouping = sites(9, 1, 12, 7, 3, 8)
    found = halvings(grouping, synthesized=30, repeats=20, most=1000, rng=np.random.default_rng(0))
    assert len(found) == 20
    for one in found:
        ours, theirs = grouping.labels[one.reference], grouping.labels[one.heldout]
        assert not set(ours.tolist()) & set(theirs.tolist())
        assert len(one.reference) == len(one.heldout) == len(one.synthesized) >= 14
        assert len(set(one.reference.tolist())) == len(one.reference)
        assert one.synthesized.min() >= 40
        assert one.synthesized.max() < 70
    assert len({tuple(sorted(one.reference.tolist())) for one in found}) > 5


@pytest.mark.parametrize(("real", "synthesized"), [(0, 30), (1, 30), (9, 30), (30, 4), (30, 0)])
def test_with_less_than_five_on_a_side_there_is_no_halving(real: int, synthesized: int) -> None:
    grouping = Grouping("environment", np.arange(real))
    rng = np.random.default_rng(0)
    assert not halvings(grouping, synthesized=synthesized, repeats=3, most=99, rng=rng)


def test_sites_are_preferred_then_logs_then_every_environment_by_itself() -> None:
    logs = ["l1", "l2", "l1"]
    by_site = coarsest_grouping(["a", "b", "b"], logs, count=3)
    assert (by_site.named(), by_site.labels.tolist()) == ("by site (2)", [0, 1, 1])
    by_log = coarsest_grouping(["a", "a", "a"], logs, count=3)
    assert (by_log.named(), by_log.labels.tolist()) == ("by log (2)", [0, 1, 0])
    assert coarsest_grouping(["a", None, "b"], [None] * 3, count=3).named() == "by environment (3)"
    assert coarsest_grouping([], [], count=0).named() == "by environment (0)"
