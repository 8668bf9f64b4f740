"""The night's scorecard: what the policy is about to be trained on, in numbers."""

from dataclasses import asdict

from flows.night_stages import Night
from flows.night_summary import ScorecardEntry
from ses_core.recipes import ArtifactRef
from ses_core.scorecard.standing import standing
from storage.scorecard_files import read_scorecard
from tasks.scorecard import score_artifacts

DRIVER = "dwa-slow"
"""Who drives through the environments: the same every night, so that nights can be compared."""


def score_night(night: Night, selection: ArtifactRef, environments: ArtifactRef) -> ArtifactRef:
    """Score the synthesized environments against the pool they were learned from."""
    made = night.count(
        "synthesize",
        score_artifacts.submit(
            selection,
            environments,
            policy=DRIVER,
            store=night.store,
            settings=night.settings,
            anew="synthesize" in night.anew,
        ).result(),
    )
    night.summary.scorecard = [
        ScorecardEntry(standing=standing(row), **asdict(row))
        for row in read_scorecard(night.store.path(made.ref))
    ]
    return made.ref
