"""What a night's page says of verified difficulty: logged against simulated counts."""

import numpy as np

from ses_core.arrays import FloatArray
from ses_core.evaluation.difficulty import simulated_count
from ses_core.evaluation.label_agreement import agreement_by_group, label_agreement
from ses_core.extraction.funnel import COUNT_WORDS
from ses_core.navigation import NavigationDomain
from storage.artifact_store import LocalArtifactStore
from storage.difficulty_files import read_difficulties
from storage.night_artifacts import NightArtifacts
from storage.night_report import DifficultyUse
from storage.selection_files import StoredSelection


def gather_difficulty(
    night: NightArtifacts,
    selection: StoredSelection | None,
    synthesized: NavigationDomain,
    *,
    store: LocalArtifactStore,
) -> DifficultyUse | None:
    """Set the simulated counts of a night beside the logged ones; None where nobody drove again.

    Raises:
        ArtifactError: The artifact is missing or damaged.
    """
    if night.difficulty is None or selection is None:
        return None
    rows = read_difficulties(store.path(night.difficulty))
    if not rows:
        return None
    settings = night.settings
    kind, period = settings.filter.count_kind, 1.0 / settings.simulation.control_rate_hz
    counts = {row.environment_id: simulated_count(row, kind, period=period) for row in rows}
    pool = selection.pool[selection.pool["environment_id"].isin(list(counts))]
    logged = pool["count"].to_numpy(dtype=np.float64)
    simulated = np.array([counts[name] for name in pool["environment_id"]], dtype=np.float64)
    threshold = _threshold(night, selection)
    driven = [
        counts[one.environment_id]
        for one in synthesized.environments
        if one.environment_id in counts
    ]
    return DifficultyUse(
        driver=night.parent,
        trials=rows[0].trials,
        count_name=COUNT_WORDS[kind],
        logged=logged,
        simulated=simulated,
        threshold=threshold,
        whole=label_agreement(logged, simulated, threshold=threshold),
        sites=agreement_by_group(logged, simulated, pool["site"].tolist(), threshold=threshold),
        synthesized=len(driven),
        synthesized_hard=float(np.mean(np.array(driven) > threshold)) if driven else None,
    )


def _threshold(night: NightArtifacts, selection: StoredSelection) -> float:
    """Give the threshold in force: where a share was chosen, just below the least count chosen."""
    settings = night.settings.filter
    counts: FloatArray = selection.pool["count"].to_numpy(dtype=np.float64)
    if settings.challenging_share is None or not len(counts):
        return settings.threshold
    return float(np.nextafter(counts.min(), -np.inf))
