"""`NightArtifacts`: what one night was made of, stage by stage, as references."""

from dataclasses import dataclass
from datetime import date

from ses_core.recipes import ArtifactRef, JsonValue
from ses_core.settings import Settings


@dataclass(frozen=True, slots=True, kw_only=True)
class NightArtifacts:
    """One night; a stage that had nothing to do has no artifact.

    Attributes:
        run_id: Name of the night.
        parent: Name of the policy that was gone on from: `champion` or `original`.
        decision: The verdict in a word or two.
        reasons: Why, in sentences.
        log_ids: Logs of the night's batch.
        refused: Name, reason and message of the logs that were refused.
        scorecard: How well the synthesized environments stand for the pool.
        difficulty: How hard the parent finds the pool's places and the synthesized ones.
        spot_check: Episodes of the same policies in PyBullet.
        stages: Built, found and seconds by stage, up to here.
        is_demonstration: Whether the page has to say so.
    """

    run_id: str
    batch_date: date
    settings: Settings
    parent: str
    decision: str
    reasons: tuple[str, ...]
    log_ids: tuple[str, ...]
    refused: tuple[tuple[str, str, str], ...]
    known_logs: int
    waiting_logs: int
    selection: ArtifactRef | None
    environments: ArtifactRef | None
    scorecard: ArtifactRef | None
    difficulty: ArtifactRef | None
    worlds: ArtifactRef | None
    policy: ArtifactRef | None
    evaluation: ArtifactRef | None
    spot_check: ArtifactRef | None
    stages: tuple[tuple[str, int, int, float], ...]
    is_demonstration: bool

    def refs(self) -> dict[str, ArtifactRef]:
        """Give the artifacts that are there, by stage."""
        stages = {
            "filter": self.selection,
            "synthesize": self.environments,
            "scorecard": self.scorecard,
            "difficulty": self.difficulty,
            "render": self.worlds,
            "train": self.policy,
            "evaluate": self.evaluation,
            "spot check": self.spot_check,
        }
        return {stage: ref for stage, ref in stages.items() if ref is not None}

    def key(self) -> dict[str, JsonValue]:
        """Give what decides the night's page and tables; not how long its stages took."""
        return {
            "run_id": self.run_id,
            "batch_date": self.batch_date.isoformat(),
            "parent": self.parent,
            "decision": self.decision,
            "reasons": self.reasons,
            "log_ids": self.log_ids,
            "refused": self.refused,
            "artifacts": {stage: str(ref) for stage, ref in self.refs().items()},
            "is_demonstration": self.is_demonstration,
        }
