"""`NightReport`: everything the page of one night shows, as plain data."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ses_core.arrays import BoolArray, FloatArray, IntArray
from ses_core.evaluation.comparison import Comparison
from ses_core.evaluation.episodes import Episode
from ses_core.evaluation.label_agreement import LabelAgreement
from ses_core.evaluation.statistics import PolicySummary
from ses_core.extraction.funnel import FunnelStep
from ses_core.learning.training_curve import CurvePoint
from ses_core.robot_profile import RobotProfile
from ses_core.scorecard.result import Scorecard


@dataclass(frozen=True, slots=True, kw_only=True)
class TakenLog:
    """A log that was taken in; its name and robot are whatever its uploader wrote."""

    name: str
    robot: str
    site: str
    format: str
    duration_s: float
    path_length_m: float
    scenarios: int
    challenging: int
    warnings: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class RefusedLog:
    """A log in quarantine: its reason from the closed list, and that in plain words."""

    name: str
    reason: str
    explanation: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Funnel:
    """From logs to environments.

    Attributes:
        steps: Levels of the funnel, widest first.
        rule: What made a scenario challenging tonight, in words.
        count_name: The count that chose, in words.
        other_name: The count printed beside it, in words.
        remarks: What else to know: held-out places, unknown velocities, caps that were reached.
    """

    steps: tuple[FunnelStep, ...]
    rule: str
    count_name: str
    other_name: str
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity:
    """Challenging scenarios by threshold: thresholds (T,), counts (T,) by kind of count.

    `threshold` is the one in force; None where a share was chosen instead.
    """

    thresholds: FloatArray
    challenging: Mapping[str, IntArray]
    threshold: float | None
    scenario_count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownEnvironment:
    """One picture of a gallery, with what it can be found by.

    Attributes:
        cells: (30, 30), True = occupied.
        observed: (30, 30), True = seen.
        origin: `scan` or `map`, or the name of the synthesizer.
        scenario_id: What it was rebuilt from; empty for a synthesized one, as site and robot.
        count: By the night's kind of count; None where unknown.
        is_traversable: The target robot gets from start to goal.
        is_chosen: The night learns from it, or trained in it.
    """

    environment_id: str
    cells: BoolArray
    observed: BoolArray
    origin: str
    scenario_id: str = ""
    site: str = ""
    robot: str = ""
    count: float | None = None
    is_traversable: bool = True
    is_chosen: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class StageUse:
    """How often a stage built something, how often it found it, and how long that took."""

    name: str
    built: int
    found: int
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SynthesisUse:
    """How the training environments came to be; see `SynthesisResult`."""

    method_asked: str
    method_used: str
    drawn: int
    rejected_share: float
    repeated: int
    copied: int
    repaired: int = 0
    repaired_cells: float = 0.0
    beyond_repair: int = 0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class DifficultyUse:
    """What became of the pool's labels when its places were driven through again.

    Attributes:
        driver: Who drove.
        trials: Drives through each place.
        count_name: The count, in words.
        logged: (N,) by the log, of the recorded places.
        simulated: (N,) of the same places driven again, means over the trials.
        threshold: What the log calls challenging is above it.
        whole: Agreement over all recorded places.
        sites: Agreement site by site.
        synthesized: Synthesized environments driven.
        synthesized_hard: Share of these whose count is above the threshold; None without any.
    """

    driver: str
    trials: int
    count_name: str
    logged: FloatArray
    simulated: FloatArray
    threshold: float
    whole: LabelAgreement
    sites: Mapping[str, LabelAgreement]
    synthesized: int
    synthesized_hard: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingUse:
    """What was trained, from which policy, and how training episodes went."""

    policy: str
    parent: str
    algorithm: str
    decisions: int
    environments: int
    seconds: float
    curve: tuple[CurvePoint, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluationUse:
    """Trials on held-out worlds: policies and trials in the order they are shown."""

    rows: tuple[PolicySummary, ...]
    comparisons: tuple[Comparison, ...]
    worlds: int
    episodes: tuple[Episode, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """What was decided about the new policy, and why.

    Attributes:
        verdict: Two or three words, such as `insufficient evidence`.
        reasons: Whole sentences.
        is_promoted: Whether the new policy is the champion now.
    """

    verdict: str
    reasons: tuple[str, ...]
    is_promoted: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedPicture:
    """A PNG to look at, with what it shows."""

    title: str
    png: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class NightReport:
    """One night.

    Attributes:
        robot: The robot that everything is for: trained, measured, and able to cross.
        recorded: Rebuilt environments: the chosen, hardest first, then the rest of the night's
            own; the page shows the first ones.
        synthesized: Environments that were trained in.
        scorecard: How well these stand for the recorded ones that were learned from.
        difficulty: How hard both turned out when they were driven through.
        pictures: Further pictures: logs over their paths, rendered worlds.
        lineage: What was made from what: names and digests, in order.
        demonstration_decisions: Decisions trained, when the night is a demonstration.
    """

    run_id: str
    batch_date: str
    robot: RobotProfile
    decision: Decision
    logs: tuple[TakenLog, ...] = ()
    refused: tuple[RefusedLog, ...] = ()
    known_logs: int = 0
    waiting_logs: int = 0
    funnel: Funnel | None = None
    sensitivity: Sensitivity | None = None
    recorded: tuple[ShownEnvironment, ...] = ()
    synthesis: SynthesisUse | None = None
    synthesized: tuple[ShownEnvironment, ...] = ()
    scorecard: Scorecard | None = None
    difficulty: DifficultyUse | None = None
    training: TrainingUse | None = None
    evaluation: EvaluationUse | None = None
    champion: str | None = None
    stages: tuple[StageUse, ...] = ()
    pictures: tuple[NamedPicture, ...] = ()
    lineage: tuple[tuple[str, str], ...] = ()
    warnings: tuple[str, ...] = ()
    demonstration_decisions: int | None = None


def headline(report: NightReport) -> str:
    """Say in one sentence what the night came to."""
    training, evaluation = report.training, report.evaluation
    if training is None:
        if not report.logs and not report.refused:
            return "No new logs came in, so there was nothing to learn from."
        if not report.logs:
            return f"{_count(len(report.refused), 'log')} came in and none could be read."
        return f"{_count(len(report.logs), 'new log')} read, and no policy trained."
    trained = f"A policy was trained in {_count(training.environments, 'environment')}"
    comparison = _against_parent(training.parent, evaluation)
    if evaluation is None or comparison is None:
        return f"{trained}, and could not be measured against the one it came from."
    rates = {row.policy: row.success_rate for row in evaluation.rows}
    ending = "it is the champion now" if report.decision.is_promoted else "nothing was promoted"
    return (
        f"{trained}. On worlds it had never seen it succeeds in "
        f"{_percent(rates[comparison.policy])} of trials, the policy it came from in "
        f"{_percent(rates[comparison.baseline])}: {report.decision.verdict}, {ending}."
    )


def describe_robot(profile: RobotProfile) -> str:
    """Say in a few words what body and laser a robot has."""
    if profile.radius_m > 0:
        body = f"round, {2 * profile.radius_m:.2f} m across"
    else:
        (back, front), (right, left) = (
            (min(side), max(side)) for side in zip(*profile.footprint_m, strict=True)
        )
        body = f"{front - back:.2f} m long and {left - right:.2f} m wide"
    laser = profile.laser
    view = math.degrees(laser.angle_max_rad - laser.angle_min_rad)
    return f"{body}, laser of {laser.beams} beams over {view:.0f}\N{DEGREE SIGN}"


def _against_parent(parent: str, evaluation: EvaluationUse | None) -> Comparison | None:
    if evaluation is None:
        return None
    by_baseline = {comparison.baseline: comparison for comparison in evaluation.comparisons}
    return by_baseline.get(parent)


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}" if number == 1 else f"{number:,} {noun}s"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f}\N{NO-BREAK SPACE}%"
