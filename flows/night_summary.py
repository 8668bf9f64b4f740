"""`NightSummary`: what a night did, as `ses nightly --json` prints it and the UI shows it."""

from datetime import date
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from ses_core.scorecard.standing import Standing

StageName = Literal[
    "ingest", "extract", "filter", "synthesize", "render", "train", "evaluate", "report"
]

STAGES: tuple[StageName, ...] = (
    "ingest",
    "extract",
    "filter",
    "synthesize",
    "render",
    "train",
    "evaluate",
    "report",
)
"""The stages in order, as `--refresh` names them."""

Interval = tuple[float, float]


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", from_attributes=True)


class StageCount(_Part):
    """How often a stage built something, how often it found it, and how long that took [s]."""

    built: int = 0
    found: int = 0
    seconds: float = 0.0


class LogCounts(_Part):
    """What became of the inbox."""

    new: int = 0
    known: int = 0
    quarantined: int = 0
    waiting: int = Field(0, description="Still arriving: left for the next night.")
    ignored: int = Field(0, description="No logs: other files in the inbox.")
    unknown_robot: int = Field(0, description="New logs whose robot or site nothing names.")


class EvaluationRow(_Part):
    """One policy's trials on the held-out worlds; no interval from fewer than two worlds."""

    policy: str
    success_rate: float
    success_ci: Interval | None
    mean_time_s: float | None
    restricted_mean_time_s: float
    collision_rate: float
    timeout_rate: float
    stuck_rate: float
    barn_score: float
    trials: int
    worlds: int


class ComparisonRow(_Part):
    """The new policy against another one, on the same worlds, pairs and seeds."""

    policy: str
    baseline: str
    success_difference: float
    ci: Interval | None
    time_difference_s: float
    ci_s: Interval | None


class ScorecardEntry(_Part):
    """One number of the synthesized environments beside the same one between real ones."""

    metric: str
    feature: str
    unit: str
    aim: str
    value: float | None
    low: float | None
    high: float | None
    real_value: float | None
    real_low: float | None
    real_high: float | None
    p_value: float | None
    real_p_value: float | None
    n_real: int
    n_synthesized: int
    halves: str
    standing: Standing = Field(description="Whether it is worse than real-against-real allows.")
    note: str


class NightSummary(_Part):
    """One nightly batch; keys are public (see the README)."""

    run_id: str = ""
    batch_date: date
    logs: LogCounts = LogCounts()
    scenarios: int = 0
    challenging: int = 0
    count_kind: str = ""
    challenging_by_count: dict[str, int] = Field(
        default_factory=dict, description="Challenging scenarios by the kind of count."
    )
    environments: int = 0
    scorecard: list[ScorecardEntry] = Field(
        default_factory=list,
        description="How well the environments stand for those learned from.",
    )
    stages: dict[str, StageCount] = Field(
        default_factory=lambda: {str(stage): StageCount() for stage in STAGES}
    )
    evaluation: list[EvaluationRow] = Field(default_factory=list)
    comparisons: list[ComparisonRow] = Field(default_factory=list)
    decision: str = "nothing-new"
    reason: str = ""
    champion: str | None = None
    policy: str | None = None
    decisions_trained: int = 0
    report: str | None = None

    def count(self, stage: StageName, *, found: bool, seconds: float) -> None:
        """Add one task's outcome to its stage."""
        counts = self.stages[stage]
        counts.found += found
        counts.built += not found
        counts.seconds = round(counts.seconds + seconds, 3)


def stages_from(refresh: StageName | None) -> frozenset[StageName]:
    """List a stage and all after it: those that are built anew; none for None."""
    return frozenset() if refresh is None else frozenset(STAGES[STAGES.index(refresh) :])
