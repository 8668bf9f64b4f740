"""Which state of a generator to keep: the one that covers held-out environments best."""

import math
import statistics

import numpy as np
from numpy.random import Generator

from ses_core.arrays import BoolArray, IntArray
from ses_core.navigation import NavigationDomain
from ses_core.recipes import digest_json
from ses_core.scorecard.distances import clearance_feature, distinct_maps, euclidean
from ses_core.scorecard.manifolds import manifold_scores
from ses_core.synthesis.generator_network import GeneratorNetwork
from ses_core.synthesis_settings import GanSettings


def held_out(domain: NavigationDomain, *, settings: GanSettings) -> tuple[IntArray, IntArray]:
    """Choose which environments of a domain are trained on, and which are held out.

    They are chosen by their ids: what yesterday's fit was not taught, today's is not taught
    either, so a warm start is not judged by what it knows. Too few different ones would tell
    nothing: then none is held out.
    """
    identities = [environment.environment_id for environment in domain.environments]
    size = min(math.floor(settings.heldout_share * len(identities)), settings.most_heldout)
    if size < settings.least_heldout:
        size = 0
    order = np.argsort([digest_json([identity]) for identity in identities], kind="stable")
    kept_back = np.sort(order[:size])
    different = len(np.unique(domain.cells()[kept_back].reshape(size, -1), axis=0)) if size else 0
    if different <= settings.coverage_neighbours:
        size = 0
    return np.sort(order[size:]), np.sort(order[:size])


class SnapshotChoice:
    """Keeps the best of the generators it is shown, of equals the later.

    Without anything held out that is the last.
    """

    def __init__(self, heldout: BoolArray, *, settings: GanSettings, rng: Generator) -> None:
        """Take held-out environments (H, 30, 30)."""
        self._heldout = heldout
        self._settings = settings
        self._noise_seed = int(rng.integers(2**63))
        self._best: GeneratorNetwork | None = None
        self._best_coverage = -1.0
        self._worse_in_a_row = 0

    @property
    def best(self) -> GeneratorNetwork:
        """The best one so far.

        Raises:
            ValueError: None was shown.
        """
        if self._best is None:
            raise ValueError("found no generator to choose from, expected at least one")
        return self._best

    @property
    def is_over(self) -> bool:
        """Whether so many in a row were worse that more are not worth their time."""
        return self._worse_in_a_row >= self._settings.patience

    def consider(self, network: GeneratorNetwork) -> None:
        """Look at one more; all are given the same noise, so that chance has less of a say."""
        count = len(self._heldout)
        if count == 0:
            self._best = network
            return
        draws = self._settings.coverage_draws
        drawn = network.sample(draws * count, rng=np.random.default_rng(self._noise_seed))
        found = statistics.mean(
            coverage(self._heldout, one, k=self._settings.coverage_neighbours)
            for one in np.split(drawn, draws)
        )
        # Of equals the later one has been taught for longer.
        if found >= self._best_coverage:
            self._best, self._best_coverage, self._worse_in_a_row = network, found, 0
        else:
            self._worse_in_a_row += 1


def coverage(heldout: BoolArray, generated: BoolArray, *, k: int) -> float:
    """Give the share of the held-out with a generated one in the ball to their k-th nearest.

    Distances are between clearances; ties are handled as on the scorecard. With k different
    held-out environments or fewer there are no balls, and nothing is covered.

    Args:
        heldout: (H, 30, 30).
        generated: (M, 30, 30).
        k: Which nearest of the other held-out ones a ball reaches to.
    """
    maps = distinct_maps(np.concatenate((heldout, generated)))
    scores = manifold_scores(
        euclidean(clearance_feature(maps.cells)),
        maps.index[: len(heldout)],
        maps.index[len(heldout) :],
        k=k,
    )
    return 0.0 if scores is None else scores.coverage
