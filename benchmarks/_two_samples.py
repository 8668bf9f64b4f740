"""Two-sample tests: can one set of worlds be told from another."""

from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.spatial import distance
from sklearn.base import ClassifierMixin
from sklearn.ensemble import RandomForestClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import roc_auc_score
from sklearn.model_selection import StratifiedKFold, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from ses_core.arrays import FloatArray

PERMUTATIONS = 999
RESAMPLES = 999
FOLDS = 10


class Comparison(NamedTuple):
    """A statistic and the share of permutations that reach it."""

    statistic: float
    p: float


class Separation(NamedTuple):
    """How well a classifier tells two sets apart on worlds it has not seen: 0.5 is not at all.

    The interval is the 95 % bootstrap over worlds of the scores given across folds.
    """

    auc: float
    low: float
    high: float


def compare_values(ours: FloatArray, theirs: FloatArray, *, seed: int) -> Comparison:
    """Kolmogorov-Smirnov distance of values (N,) and (M,), with a permutation p-value."""
    rng = np.random.default_rng(seed)
    both = np.concatenate((ours, theirs))
    found = stats.ks_2samp(ours, theirs).statistic
    reached = 0
    for _ in range(PERMUTATIONS):
        mixed = rng.permutation(both)
        reached += _ks(mixed[: len(ours)], mixed[len(ours) :]) >= found - 1e-12
    return Comparison(float(found), (1 + reached) / (1 + PERMUTATIONS))


def compare_points(ours: FloatArray, theirs: FloatArray, *, seed: int) -> Comparison:
    """Energy distance of points (N, D) and (M, D), scaled to equal spread, with permutations."""
    rng = np.random.default_rng(seed)
    both = np.concatenate((ours, theirs))
    both = (both - both.mean(axis=0)) / both.std(axis=0)
    apart = distance.squareform(distance.pdist(both))
    sides = np.concatenate(
        (np.full(len(ours), 1 / len(ours)), np.full(len(theirs), -1 / len(theirs)))
    )
    found = -float(sides @ apart @ sides)
    reached = 0
    for _ in range(PERMUTATIONS):
        mixed = rng.permutation(sides)
        reached += -float(mixed @ apart @ mixed) >= found - 1e-12
    return Comparison(found, (1 + reached) / (1 + PERMUTATIONS))


def linear_separation(ours: FloatArray, theirs: FloatArray, *, seed: int) -> Separation:
    """Classifier two-sample test by logistic regression on points (N, D) and (M, D)."""
    return _separation(
        make_pipeline(StandardScaler(), LogisticRegression(max_iter=1000)), ours, theirs, seed
    )


def forest_separation(ours: FloatArray, theirs: FloatArray, *, seed: int) -> Separation:
    """Classifier two-sample test by a random forest on points (N, D) and (M, D)."""
    forest = RandomForestClassifier(300, min_samples_leaf=5, random_state=seed)
    return _separation(forest, ours, theirs, seed)


def _separation(
    classifier: ClassifierMixin, ours: FloatArray, theirs: FloatArray, seed: int
) -> Separation:
    points = np.concatenate((ours, theirs))
    labels = np.repeat((0, 1), (len(ours), len(theirs)))
    folds = StratifiedKFold(FOLDS, shuffle=True, random_state=seed)
    scores = cross_val_predict(classifier, points, labels, cv=folds, method="predict_proba")[:, 1]
    rng = np.random.default_rng(seed)
    aucs = []
    for _ in range(RESAMPLES):
        chosen = np.concatenate(
            [
                rng.choice(np.flatnonzero(labels == label), (labels == label).sum())
                for label in (0, 1)
            ]
        )
        aucs.append(roc_auc_score(labels[chosen], scores[chosen]))
    low, high = np.percentile(aucs, (2.5, 97.5))
    return Separation(float(roc_auc_score(labels, scores)), float(low), float(high))


def _ks(ours: FloatArray, theirs: FloatArray) -> float:
    ours, theirs = np.sort(ours), np.sort(theirs)
    both = np.concatenate((ours, theirs))
    below = np.searchsorted(ours, both, side="right") / len(ours)
    below_theirs = np.searchsorted(theirs, both, side="right") / len(theirs)
    return float(np.abs(below - below_theirs).max())
