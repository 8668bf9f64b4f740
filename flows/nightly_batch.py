"""The night: from the fleet's new logs to a policy that was measured, and a page about it."""

import datetime as dt
import time
from pathlib import Path
from typing import Any, cast

from prefect import flow
from prefect.futures import PrefectFuture
from prefect.task_runners import TaskRunner, ThreadPoolTaskRunner

from flows.night_announcement import announce_night
from flows.night_conclusion import conclude_night, made_nothing, measure
from flows.night_difficulty import verify_night
from flows.night_scorecard import score_night
from flows.night_stages import (
    Night,
    batch_day,
    evaluate,
    extract_logs,
    name_run,
    open_night,
    select_places,
    synthesize_environments,
    take_in_logs,
    train,
)
from flows.night_summary import NightSummary, StageName
from ses_core.recipes import ArtifactRef
from ses_core.settings import Settings
from storage.night_artifacts import NightArtifacts
from storage.policy_registry import PolicyRegistry
from tasks.evaluate import HeldoutWorlds

RUNNER = cast("TaskRunner[PrefectFuture[Any]]", ThreadPoolTaskRunner(max_workers=2))
"""Two logs at once: each is decoded in a process of its own."""


@flow(name="nightly", flow_run_name="night over {inbox}", task_runner=RUNNER)
def nightly(
    inbox: Path,
    root: Path,
    date: dt.date | None = None,
    settings: Settings = Settings(),  # noqa: B008  (frozen; the UI shows it as the form's defaults)
    heldout_worlds: tuple[Path, ...] = (),
    heldout_part: str | None = None,
    heldout_resolution: float | None = None,
    refresh: StageName | None = None,
    deadline_hours: float | None = None,
    demonstration: bool = False,
) -> NightSummary:
    """Take in new logs, learn from the places where robots struggled, and report.

    Args:
        inbox: Folder of uploaded logs, `<site>/<robot>/<log>`.
        root: Folder of the store, where everything is kept.
        date: Day of the batch that new logs go into; today (UTC) by default.
        settings: Everything else a night depends on, stage by stage.
        heldout_worlds: Worlds to measure on; by default places held out from the logs.
        heldout_part: Of these, only one part by their `split.csv`.
        heldout_resolution: Of images of worlds that carry none [m per pixel].
        refresh: Build this stage and all after it anew.
        deadline_hours: Training stops this long after the start, wherever it is.
        demonstration: Say on the page that this is no evidence.
    """
    deadline = None if deadline_hours is None else time.time() + 3600.0 * deadline_hours
    outside = HeldoutWorlds(
        paths=tuple(heldout_worlds), part=heldout_part, resolution=heldout_resolution
    )
    with open_night(
        root, settings=settings, date=date, refresh=refresh, purpose="nightly"
    ) as night:
        take_in_logs(night, inbox)
        extracted = extract_logs(night)
        artifacts = learn(night, extracted, outside, deadline=deadline)
        conclude_night(night, artifacts, is_demonstration=demonstration)
        announce_night(night.summary, night.records)
        return night.summary


def learn(
    night: Night,
    extracted: list[ArtifactRef],
    outside: HeldoutWorlds,
    *,
    deadline: float | None,
) -> NightArtifacts:
    """Go from extracted logs to a judged policy, as far as there is something to learn from."""
    day = batch_day(night)
    parent = "champion" if PolicyRegistry(night.store.layout).champion() else "original"
    run_id = name_run(night, extracted, day=day, parent=parent, outside=outside)
    if not extracted:
        return made_nothing(night, run_id, day=day, parent=parent)
    selection_ref, selection = select_places(night, extracted, day=day)
    if len(selection.pool) < night.settings.synthesis.least_pool:
        return made_nothing(night, run_id, day=day, parent=parent, selection=selection_ref)
    environments, worlds = synthesize_environments(night, selection_ref)
    if not night.summary.environments:
        return made_nothing(night, run_id, day=day, parent=parent, selection=selection_ref)
    scorecard = score_night(night, selection_ref, environments)
    difficulty = verify_night(night, selection_ref, environments, parent=parent)
    policy = train(
        night,
        environments,
        difficulty=difficulty,
        parent=parent,
        run_id=run_id,
        deadline=deadline,
    )
    policies = {
        run_id: str(night.store.path(policy)),
        parent: parent,
        "dwa-slow": "dwa-slow",
        "dwa-fast": "dwa-fast",
    }
    heldout = outside if outside.paths else HeldoutWorlds(selection=selection_ref)
    evaluation, spot_check = evaluate(night, policies, heldout, environments=environments)
    return measure(
        night,
        run_id,
        day=day,
        parent=parent,
        selection=selection_ref,
        environments=environments,
        scorecard=scorecard,
        difficulty=difficulty,
        worlds=worlds,
        policy=policy,
        evaluation=evaluation,
        spot_check=spot_check,
    )


@flow(name="ingest", flow_run_name="ingest {inbox}", task_runner=RUNNER)
def ingest_only(
    inbox: Path,
    root: Path,
    date: dt.date | None = None,
    settings: Settings = Settings(),  # noqa: B008
    refresh: StageName | None = None,
) -> NightSummary:
    """Take in new logs, and nothing more.

    Args:
        inbox: Folder of uploaded logs, `<site>/<robot>/<log>`.
        root: Folder of the store.
        date: Day of the batch that new logs go into; today (UTC) by default.
        settings: Those of `ingest` matter.
        refresh: `ingest` decodes known logs anew.
    """
    with open_night(root, settings=settings, date=date, refresh=refresh, purpose="ingest") as night:
        take_in_logs(night, inbox)
        night.summary.decision = "ingested"
        announce_night(night.summary, night.records)
        return night.summary


@flow(name="extract", flow_run_name="extract scenarios", task_runner=RUNNER)
def extract_only(
    root: Path,
    settings: Settings = Settings(),  # noqa: B008
    refresh: StageName | None = None,
) -> NightSummary:
    """Extract the scenarios of logs taken in before, and select the challenging ones.

    Args:
        root: Folder of the store.
        settings: Those of `extraction` and `filter` matter.
        refresh: `extract` extracts known logs anew.
    """
    with open_night(
        root, settings=settings, date=None, refresh=refresh, purpose="extract"
    ) as night:
        extracted = extract_logs(night)
        if extracted:
            select_places(night, extracted, day=batch_day(night))
        night.summary.decision = "extracted"
        announce_night(night.summary, night.records)
        return night.summary
