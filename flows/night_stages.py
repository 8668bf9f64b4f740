"""The stages of a night as the flow calls them: submit a task, count what it built or found."""

import datetime as dt
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from flows.night_summary import NightSummary, StageName, stages_from
from ses_core.recipes import ArtifactRef, digest_json
from ses_core.settings import Settings
from storage.artifact_store import LocalArtifactStore
from storage.batch_manifest import LogRecord, make_run_id
from storage.disk_space import require_free_space
from storage.environment_files import read_environments
from storage.log_catalogue import catalogue, last_batch
from storage.materialize import Materialized
from storage.policy_files import find_policy
from storage.quarantine import Quarantine
from storage.run_lock import run_lock
from storage.selection_files import StoredSelection, read_selection
from storage.table_log import TableLog
from tasks.evaluate import HeldoutWorlds, evaluate_policies, heldout_digest
from tasks.extract import extract_scenarios, look_for_scenarios
from tasks.filter import select_scenarios
from tasks.ingest import ingest_log, look_through_inbox, refused_by_older_decoders, retry_log
from tasks.render import render_worlds
from tasks.synthesize import fit_synthesizer, sample_environments
from tasks.train import train_policy


@dataclass(frozen=True, slots=True, kw_only=True)
class Night:
    """One night under way.

    Attributes:
        tables: Opened once for the whole night.
        today: Day of the batch that new logs go into.
        anew: Stages that are built although their results are there.
        summary: What has been done so far; grows from stage to stage.
        records: What became of each upload.
        started_stamp_ns: When it began.
    """

    store: LocalArtifactStore
    tables: TableLog
    settings: Settings
    today: dt.date
    anew: frozenset[StageName]
    summary: NightSummary
    records: list[LogRecord]
    started_stamp_ns: int

    def count(self, stage: StageName, made: Materialized) -> Materialized:
        """Count an artifact towards its stage."""
        self.summary.count(stage, found=made.found, seconds=made.seconds)
        return made


@contextmanager
def open_night(
    root: Path,
    *,
    settings: Settings,
    date: dt.date | None,
    refresh: StageName | None,
    purpose: str,
) -> Iterator[Night]:
    """Open the store for a night, alone: a second night is refused at once.

    Raises:
        StoreBusyError: Another night is at work on this store.
        ArtifactError: The disk is nearly full, or the store is a newer release's.
    """
    today = date or dt.datetime.now(dt.UTC).date()
    require_free_space(root, settings.store.free_floor_mib * 2**20)
    store = LocalArtifactStore(root)
    with run_lock(store.layout, purpose=purpose):
        yield Night(
            store=store,
            tables=TableLog(store.layout),
            settings=settings,
            today=today,
            anew=stages_from(refresh),
            summary=NightSummary(batch_date=today),
            records=[],
            started_stamp_ns=time.time_ns(),
        )


def take_in_logs(night: Night, inbox: Path) -> None:
    """Take in every new log of the inbox, and those that an older decoder had refused."""
    started = time.perf_counter()
    store, tables, settings = night.store, night.tables, night.settings.ingest
    scan = look_through_inbox.submit(inbox, store=store, settings=settings).result()
    is_anew = "ingest" in night.anew
    batch_of = {log.log_id: log.batch_date for log in catalogue(tables)}
    uploads = [(candidate, night.today) for candidate in scan.new]
    if is_anew:
        uploads += [
            (known.candidate, batch_of.get(known.entry.log_id, night.today)) for known in scan.known
        ]
    futures = [
        ingest_log.submit(
            candidate,
            batch_date=batch,
            store=store,
            tables=tables,
            settings=settings,
            anew=is_anew,
        )
        for candidate, batch in uploads
    ]
    futures += [
        retry_log.submit(
            refused, batch_date=night.today, store=store, tables=tables, settings=settings
        )
        for refused in refused_by_older_decoders(store)
    ]
    taken = [future.result() for future in futures]
    recognised = [] if is_anew else scan.known
    night.records.extend(
        LogRecord(name=one.name, log_id=one.log_id, status=one.status, reason=one.reason)
        for one in taken
    )
    night.records.extend(
        LogRecord(
            name=known.candidate.name,
            log_id=known.entry.log_id,
            status="known",
            reason=known.entry.reason,
        )
        for known in recognised
    )
    logs = night.summary.logs
    logs.new = sum(one.status == "new" for one in taken)
    logs.quarantined = sum(one.status == "quarantined" for one in taken)
    logs.known = len(recognised) + sum(one.status == "known" for one in taken)
    logs.waiting, logs.ignored = len(scan.waiting), scan.ignored_count
    logs.unknown_robot = scan.unidentified_count
    counts = night.summary.stages["ingest"]
    counts.built = sum(not one.found for one in taken)
    counts.found = len(taken) - counts.built + len(recognised)
    counts.seconds = round(time.perf_counter() - started, 3)


def extract_logs(night: Night) -> list[ArtifactRef]:
    """Extract every log that is not yet extracted under today's settings; give all results."""
    started = time.perf_counter()
    store, tables, settings = night.store, night.tables, night.settings
    logs = catalogue(tables)
    state = look_for_scenarios.submit(logs, store=store, tables=tables, settings=settings).result()
    is_anew = "extract" in night.anew
    pending = logs if is_anew else state.pending
    futures = [
        extract_scenarios.submit(log, store=store, tables=tables, settings=settings, anew=is_anew)
        for log in pending
    ]
    made = [future.result() for future in futures]
    found = () if is_anew else state.extracted
    counts = night.summary.stages["extract"]
    counts.built = sum(not one.found for one in made)
    counts.found = len(made) - counts.built + len(found)
    counts.seconds = round(time.perf_counter() - started, 3)
    return [*found, *(one.ref for one in made)]


def batch_day(night: Night) -> dt.date:
    """Give the day of the newest batch, which a night without new logs belongs to as well.

    The pool's window ends there, so that nothing is built anew because a day went by.
    """
    taken = last_batch(catalogue(night.tables))
    refused = [entry.batch_date for entry in Quarantine(night.store.layout.quarantine).entries()]
    return max([*refused, *([taken] if taken else [])], default=night.today)


def select_places(
    night: Night, extracted: list[ArtifactRef], *, day: dt.date
) -> tuple[ArtifactRef, StoredSelection]:
    """Choose the challenging places of the last days, and those held out."""
    made = night.count(
        "filter",
        select_scenarios.submit(
            extracted,
            last_batch=day,
            store=night.store,
            tables=night.tables,
            settings=night.settings.filter,
            anew="filter" in night.anew,
        ).result(),
    )
    selection = read_selection(night.store.path(made.ref))
    summary, funnel = night.summary, selection.funnels[selection.count_kind]
    summary.scenarios, summary.challenging = funnel.scenarios, funnel.challenging
    summary.count_kind = selection.count_kind
    summary.challenging_by_count = {
        kind: funnel.challenging for kind, funnel in selection.funnels.items()
    }
    return made.ref, selection


def synthesize_environments(
    night: Night, selection: ArtifactRef
) -> tuple[ArtifactRef, ArtifactRef]:
    """Fit, sample and render; give the environments and their worlds."""
    store, settings = night.store, night.settings
    anew = "synthesize" in night.anew
    fit = night.count(
        "synthesize",
        fit_synthesizer.submit(
            selection, store=store, settings=settings.synthesis, anew=anew
        ).result(),
    )
    made = night.count(
        "synthesize",
        sample_environments.submit(
            fit.ref,
            selection,
            store=store,
            settings=settings.synthesis,
            target=settings.target_robot,
            anew=anew,
        ).result(),
    )
    night.summary.environments = len(read_environments(store.path(made.ref)).environments)
    worlds = render_worlds.submit(made.ref, store=store, anew="render" in night.anew).result()
    return made.ref, night.count("render", worlds).ref


def train(
    night: Night,
    environments: ArtifactRef,
    *,
    difficulty: ArtifactRef | None,
    parent: str,
    run_id: str,
    deadline: float | None,
) -> ArtifactRef:
    """Fine-tune from the parent; give the policy's bundle."""
    made = train_policy.submit(
        environments,
        difficulty=difficulty,
        parent=parent,
        run_id=run_id,
        store=night.store,
        settings=night.settings,
        deadline_stamp_s=deadline,
        anew="train" in night.anew,
    ).result()
    return night.count("train", made).ref


def evaluate(
    night: Night,
    policies: Mapping[str, str],
    heldout: HeldoutWorlds,
    *,
    environments: ArtifactRef,
) -> tuple[ArtifactRef, ArtifactRef | None]:
    """Drive all policies on the held-out worlds; the first two on some of them in PyBullet too."""
    settings = night.settings.evaluation
    anew = "evaluate" in night.anew
    made = evaluate_policies.submit(
        policies,
        heldout,
        environments=environments,
        simulator=settings.simulator,
        trials=settings.trials,
        store=night.store,
        settings=night.settings,
        anew=anew,
    ).result()
    episodes = night.count("evaluate", made).ref
    if not settings.spot_checks:
        return episodes, None
    checked = evaluate_policies.submit(
        dict(list(policies.items())[:2]),
        heldout,
        environments=environments,
        simulator="bullet",
        trials=1,
        most_places=settings.spot_checks,
        store=night.store,
        settings=night.settings,
        anew=anew,
    ).result()
    return episodes, night.count("evaluate", checked).ref


def name_run(
    night: Night,
    extracted: list[ArtifactRef],
    *,
    day: dt.date,
    parent: str,
    outside: HeldoutWorlds,
) -> str:
    """Name a night by everything that decides it: asked again, it has the same name."""
    settings = night.settings.model_dump(mode="json", exclude={"store"})
    asked = [
        digest_json(settings),
        find_policy(parent, night.store.layout).policy_id,
        heldout_digest(outside),
        *sorted(map(str, extracted)),
    ]
    return make_run_id(day, asked)
