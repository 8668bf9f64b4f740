"""From a night's artifacts to everything its page shows."""

import json
from collections.abc import Hashable, Mapping
from typing import Any

import pandas as pd

from ses_core.evaluation.comparison import compare
from ses_core.evaluation.statistics import summarize
from ses_core.extraction.funnel import (
    COUNT_WORDS,
    challenging_rule,
    funnel_remarks,
    funnel_steps,
)
from ses_core.extraction.holdout import Holdout
from ses_core.extraction.selection import COUNT_COLUMNS
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from storage.artifact_store import LocalArtifactStore
from storage.difficulty_contents import gather_difficulty
from storage.environment_files import SYNTHESIS_FILE, read_environments
from storage.evaluation_files import read_episodes
from storage.night_artifacts import NightArtifacts
from storage.night_report import (
    Decision,
    EvaluationUse,
    Funnel,
    NightReport,
    RefusedLog,
    Sensitivity,
    ShownEnvironment,
    StageUse,
    SynthesisUse,
    TakenLog,
    TrainingUse,
)
from storage.policy_files import read_curve, read_policy
from storage.quarantine import REASONS
from storage.scenario_tables import environments_of
from storage.scorecard_files import read_scored
from storage.selection_files import StoredSelection, read_selection
from storage.stage_records import read_record
from storage.table_reader import open_table
from storage.training_record import TRAINING_FILE, TrainingRecord


def gather_night(night: NightArtifacts, *, store: LocalArtifactStore) -> NightReport:
    """Read everything that the page of a night shows.

    Raises:
        ArtifactError: An artifact is missing or damaged.
    """
    root = store.layout.root
    logs = open_table(root, "logs", since=night.batch_date, until=night.batch_date)
    scenarios = open_table(root, "scenarios", since=night.batch_date, until=night.batch_date)
    selection = read_selection(store.path(night.selection)) if night.selection else None
    synthesized = (
        read_environments(store.path(night.environments))
        if night.environments
        else NavigationDomain(())
    )
    training = _training(night, store=store)
    return NightReport(
        run_id=night.run_id,
        batch_date=night.batch_date.isoformat(),
        robot=night.settings.target_robot,
        decision=Decision(verdict=night.decision.replace("-", " "), reasons=night.reasons),
        logs=_taken(logs[logs["log_id"].isin(night.log_ids)], scenarios),
        refused=tuple(
            RefusedLog(name=name, reason=reason, explanation=REASONS.get(reason, message))
            for name, reason, message in night.refused
        ),
        known_logs=night.known_logs,
        waiting_logs=night.waiting_logs,
        funnel=_funnel(night, selection, logs=len(logs), synthesized=len(synthesized.environments)),
        sensitivity=_sensitivity(night, selection),
        recorded=_recorded(night, selection, scenarios, store=store),
        synthesis=(
            read_record(store.path(night.environments) / SYNTHESIS_FILE, SynthesisUse)
            if night.environments
            else None
        ),
        synthesized=tuple(
            ShownEnvironment(
                environment_id=one.environment_id,
                cells=one.cells,
                observed=one.observed,
                origin=one.origin,
            )
            for one in synthesized.environments
        ),
        scorecard=read_scored(store.path(night.scorecard)) if night.scorecard else None,
        difficulty=gather_difficulty(night, selection, synthesized, store=store),
        training=training,
        evaluation=_evaluation(night, store=store),
        champion=None if night.parent == "original" else night.parent,
        stages=tuple(
            StageUse(name=name, built=built, found=found, seconds=seconds)
            for name, built, found, seconds in night.stages
        ),
        lineage=tuple((stage, str(ref)) for stage, ref in night.refs().items()),
        demonstration_decisions=(
            training.decisions if training and night.is_demonstration else None
        ),
    )


def _taken(logs: pd.DataFrame, scenarios: pd.DataFrame) -> tuple[TakenLog, ...]:
    whole = scenarios[scenarios["kind"] == "scenario"]
    counted = whole.groupby("log_id")["is_challenging"].agg(["size", "sum"])
    taken = []
    for row in logs.sort_values(["site", "robot", "name"]).to_dict("records"):
        log_id = row["log_id"]
        size, challenging = counted.loc[log_id] if log_id in counted.index else (0, 0)
        taken.append(
            TakenLog(
                name=row["name"],
                robot=row["robot"],
                site=row["site"],
                format=row["format"],
                duration_s=row["duration_s"],
                path_length_m=row["path_length_m"],
                scenarios=int(size),
                challenging=int(challenging),
                warnings=json.loads(row["warnings"]),
            )
        )
    return tuple(taken)


def _funnel(
    night: NightArtifacts, selection: StoredSelection | None, *, logs: int, synthesized: int
) -> Funnel | None:
    if selection is None:
        return None
    kind = selection.count_kind
    other = "negative" if kind == "not-forward" else "not-forward"
    holdout = Holdout(
        basis=selection.holdout_basis,
        heldout=selection.heldout_names,
        sides=pd.Series(dtype=object),
    )
    return Funnel(
        steps=funnel_steps(
            selection.funnels[kind], selection.funnels[other], logs=logs, synthesized=synthesized
        ),
        rule=challenging_rule(night.settings.filter),
        count_name=COUNT_WORDS[kind],
        other_name=COUNT_WORDS[other],
        remarks=funnel_remarks(selection.funnels[kind], holdout),
    )


def _sensitivity(night: NightArtifacts, selection: StoredSelection | None) -> Sensitivity | None:
    if selection is None:
        return None
    filter_settings = night.settings.filter
    return Sensitivity(
        thresholds=selection.sensitivity.thresholds,
        challenging=selection.sensitivity.challenging,
        threshold=None if filter_settings.challenging_share else filter_settings.threshold,
        scenario_count=selection.funnels[selection.count_kind].scenarios,
    )


def _recorded(
    night: NightArtifacts,
    selection: StoredSelection | None,
    scenarios: pd.DataFrame,
    *,
    store: LocalArtifactStore,
) -> tuple[ShownEnvironment, ...]:
    """Give the pool, hardest first, then what else the night's own logs show, likewise."""
    if selection is None:
        return ()
    chosen = tuple(
        _shown(one, row, count=row["count"])
        for one, row in zip(
            selection.pool_environments.environments,
            selection.pool.to_dict("records"),
            strict=True,
        )
    )
    own = scenarios[
        scenarios["log_id"].isin(night.log_ids)
        & (scenarios["kind"] == "scenario")
        & ~scenarios["environment_id"].isin([one.environment_id for one in chosen])
    ]
    places = open_table(
        store.layout.root, "environments", since=night.batch_date, until=night.batch_date
    ).drop_duplicates("environment_id")
    rest = own.merge(
        places.drop(columns="scenario_id"), on="environment_id", validate="many_to_one"
    ).assign(count=lambda rows: rows[COUNT_COLUMNS[night.settings.filter.count_kind]])
    rest = rest.sort_values(["count", "scenario_id"], ascending=[False, True])
    return chosen + tuple(
        _shown(
            one,
            row,
            count=None if pd.isna(row["count"]) else float(row["count"]),
            is_traversable=row["is_traversable"],
            is_chosen=False,
        )
        for one, row in zip(environments_of(rest), rest.to_dict("records"), strict=True)
    )


def _shown(
    environment: NavigationEnvironment,
    row: Mapping[Hashable, Any],
    *,
    count: float | None,
    is_traversable: bool = True,
    is_chosen: bool = True,
) -> ShownEnvironment:
    """Show an environment with the scenario, site and robot of its row."""
    return ShownEnvironment(
        environment_id=environment.environment_id,
        cells=environment.cells,
        observed=environment.observed,
        origin=environment.origin,
        scenario_id=row["scenario_id"],
        site=row["site"],
        robot=row["robot"],
        count=count,
        is_traversable=is_traversable,
        is_chosen=is_chosen,
    )


def _training(night: NightArtifacts, *, store: LocalArtifactStore) -> TrainingUse | None:
    if night.policy is None:
        return None
    folder = store.path(night.policy)
    record = read_record(folder / TRAINING_FILE, TrainingRecord)
    return TrainingUse(
        policy=read_policy(folder).policy_id,
        parent=record.parent,
        algorithm=record.algorithm,
        decisions=record.steps,
        environments=record.environments,
        seconds=record.seconds,
        curve=tuple(read_curve(folder)),
    )


def _evaluation(night: NightArtifacts, *, store: LocalArtifactStore) -> EvaluationUse | None:
    if night.evaluation is None:
        return None
    episodes = read_episodes(store.path(night.evaluation))
    remarks = []
    if night.spot_check is not None:
        remarks = [
            f"In PyBullet, on {row.worlds} of these worlds, {row.policy} succeeds in "
            f"{100.0 * row.success_rate:.0f} % of {row.trials} trials."
            for row in summarize(read_episodes(store.path(night.spot_check)))
        ]
    return EvaluationUse(
        rows=tuple(summarize(episodes)),
        comparisons=tuple(compare(episodes)),
        worlds=len({episode.world_id for episode in episodes}),
        episodes=tuple(episodes),
        remarks=tuple(remarks),
    )
