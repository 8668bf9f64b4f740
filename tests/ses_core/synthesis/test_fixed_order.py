import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ses_core.synthesis.fixed_order import round_the_clusters


def test_every_round_takes_one_of_each_cluster_largest_first() -> None:
    clusters = np.array([0, 0, 1, 2, 2, 2])
    keys = np.array([5.0, 1.0, 0.0, 3.0, 2.0, 1.0])
    order = round_the_clusters(clusters, keys, sizes=np.array([2.0, 1.0, 3.0]))
    assert order.tolist() == [5, 1, 2, 4, 0, 3]


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 4)), max_size=25))
def test_it_is_what_dealing_by_hand_gives(members: list[tuple[int, int]]) -> None:
    clusters = np.array([cluster for cluster, _ in members], dtype=np.int64)
    keys = np.array([key for _, key in members], dtype=np.float64)
    sizes = np.bincount(clusters, minlength=4).astype(np.float64)
    piles = [
        sorted(np.flatnonzero(clusters == number), key=lambda member: (keys[member], member))
        for number in sorted(range(4), key=lambda number: (-sizes[number], number))
    ]
    dealt = []
    while any(piles):
        dealt += [pile.pop(0) for pile in piles if pile]
    assert round_the_clusters(clusters, keys, sizes=sizes).tolist() == dealt
