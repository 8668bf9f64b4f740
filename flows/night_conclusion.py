"""How a night ends: its verdict, its rows in the tables, its page, its line in the manifest."""

import datetime as dt
import time
from typing import Any

from flows.night_stages import Night
from flows.night_summary import STAGES, ComparisonRow, EvaluationRow
from ses_core.evaluation.comparison import compare
from ses_core.evaluation.decision import NightDecision, decide, decide_without_training
from ses_core.evaluation.statistics import summarize
from ses_core.recipes import ArtifactRef
from storage.batch_manifest import RunRecord, StageRecord, read_manifest, record_run
from storage.evaluation_files import read_episodes
from storage.log_catalogue import catalogue
from storage.night_artifacts import NightArtifacts
from storage.policy_files import find_policy, read_policy
from storage.quarantine import Quarantine
from storage.selection_files import read_selection
from storage.stage_records import read_record
from storage.training_record import TRAINING_FILE, TrainingRecord
from tasks.report import report_night


def made_nothing(
    night: Night,
    run_id: str,
    *,
    day: dt.date,
    parent: str,
    selection: ArtifactRef | None = None,
) -> NightArtifacts:
    """Describe a night that had nothing to train in, and say why."""
    scenarios = challenging = usable = pool = 0
    if selection is not None:
        chosen = read_selection(night.store.path(selection))
        funnel = chosen.funnels[chosen.count_kind]
        scenarios, challenging = funnel.scenarios, funnel.challenging
        usable, pool = funnel.usable, funnel.pool
    decision = decide_without_training(
        scenarios=scenarios,
        challenging=challenging,
        usable=usable,
        pool=pool,
        least_pool=night.settings.synthesis.least_pool,
    )
    return _artifacts(night, run_id, day, parent, decision, selection=selection)


def measure(
    night: Night,
    run_id: str,
    *,
    day: dt.date,
    parent: str,
    evaluation: ArtifactRef,
    **refs: ArtifactRef | None,
) -> NightArtifacts:
    """Judge the new policy by its trials."""
    episodes = read_episodes(night.store.path(evaluation))
    comparisons = compare(episodes) if episodes else []
    summary = night.summary
    summary.evaluation = [EvaluationRow.model_validate(row) for row in summarize(episodes)]
    summary.comparisons = [ComparisonRow.model_validate(row) for row in comparisons]
    decision = decide(comparisons, parent=parent)
    measured = evaluation if episodes else None
    return _artifacts(night, run_id, day, parent, decision, evaluation=measured, **refs)


def conclude_night(night: Night, artifacts: NightArtifacts, *, is_demonstration: bool) -> None:
    """Write tables, page and manifest, and fill in the summary."""
    summary, store = night.summary, night.store
    summary.run_id, summary.batch_date = artifacts.run_id, artifacts.batch_date
    summary.decision, summary.reason = artifacts.decision, " ".join(artifacts.reasons)
    summary.champion = find_policy("champion", store.layout).policy_id
    if artifacts.policy is not None:
        folder = store.path(artifacts.policy)
        summary.policy = read_policy(folder).policy_id
        summary.decisions_trained = read_record(folder / TRAINING_FILE, TrainingRecord).steps
    night_page = NightArtifacts(
        **{
            **{name: getattr(artifacts, name) for name in NightArtifacts.__slots__},
            "stages": _stages(night),
            "is_demonstration": is_demonstration,
        }
    )
    made = report_night.submit(
        night_page, store=store, tables=night.tables, anew="report" in night.anew
    ).result()
    night.count("report", made)
    summary.report = str(store.layout.report_page(artifacts.batch_date))
    _record(night, artifacts)


def _artifacts(
    night: Night,
    run_id: str,
    day: dt.date,
    parent: str,
    decision: NightDecision,
    **refs: Any,
) -> NightArtifacts:
    logs = [log for log in catalogue(night.tables) if log.batch_date == day]
    refused = [
        (entry.relative, entry.reason, entry.message)
        for entry in Quarantine(night.store.layout.quarantine).entries()
        if entry.batch_date == day
    ]
    return NightArtifacts(
        run_id=run_id,
        batch_date=day,
        settings=night.settings,
        parent=parent,
        decision=decision.verdict,
        reasons=decision.reasons,
        log_ids=tuple(log.log_id for log in logs),
        refused=tuple(refused),
        known_logs=night.summary.logs.known,
        waiting_logs=night.summary.logs.waiting,
        **{name: refs.get(name) for name in _REFS},
        stages=(),
        is_demonstration=False,
    )


_REFS = (
    "selection",
    "environments",
    "scorecard",
    "difficulty",
    "worlds",
    "policy",
    "evaluation",
    "spot_check",
)


def _stages(night: Night) -> tuple[tuple[str, int, int, float], ...]:
    counts = night.summary.stages
    return tuple(
        (stage, counts[stage].built, counts[stage].found, counts[stage].seconds)
        for stage in STAGES
        if stage != "report"
    )


def _record(night: Night, artifacts: NightArtifacts) -> None:
    """Write the night into its day's manifest; one that built nothing leaves it as it is."""
    summary, layout = night.summary, night.store.layout
    manifest = read_manifest(layout, artifacts.batch_date)
    is_recorded = manifest and any(run.run_id == artifacts.run_id for run in manifest.runs)
    if is_recorded and not any(count.built for count in summary.stages.values()):
        return
    refs = artifacts.refs()
    record = RunRecord(
        run_id=artifacts.run_id,
        started_stamp_ns=night.started_stamp_ns,
        seconds=round((time.time_ns() - night.started_stamp_ns) * 1e-9, 3),
        logs=tuple(night.records),
        stages=tuple(
            StageRecord(
                stage=stage,
                built=counts.built,
                found=counts.found,
                seconds=counts.seconds,
                artifacts=(str(refs[stage]),) if stage in refs else (),
            )
            for stage, counts in summary.stages.items()
        ),
        decision=summary.decision,
        champion=summary.champion or "",
        summary=summary.model_dump(mode="json"),
    )
    record_run(layout, artifacts.batch_date, record)
