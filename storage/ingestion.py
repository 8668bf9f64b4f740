"""One log, from a claimed copy to rows in the tables or a place in quarantine."""

import shutil
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Literal

from ses_core.errors import LogError
from ses_core.extraction.recording import Recording
from ses_core.extraction.resampling import find_cuts, resample, velocity_source
from ses_core.extraction.robot_matching import Identity, profile_of
from ses_core.extraction.tabled_drives import split_drives
from ses_core.extraction.trajectory import Trajectory
from ses_core.recipes import ArtifactRef, JsonValue, Recipe, settings_json
from ses_core.robot_profile import RobotProfile
from ses_core.settings import IngestSettings
from storage.artifact_store import LocalArtifactStore
from storage.inbox import Candidate
from storage.inbox_ledger import InboxLedger, LedgerEntry
from storage.log_decoder import DECODER_VERSION, decode_log, decode_tables
from storage.log_formats import TABLES
from storage.materialize import Materialized, materialize
from storage.quarantine import Quarantine, QuarantinedLog
from storage.spool import ClaimedLog, RefusedClaimError, claim
from storage.stages import INGEST
from storage.table_log import TableLog
from storage.table_parts import artifact_parts
from storage.trajectory_tables import LogDescription, write_ingested


@dataclass(frozen=True, slots=True, kw_only=True)
class TakenIn:
    """What became of one upload.

    Attributes:
        status: `new`, `known` by its content from an earlier night, or `quarantined`.
        reason: Why it was refused, from the closed list; empty otherwise.
        found: Whether its trajectories were in the store already.
    """

    name: str
    log_id: str
    status: Literal["new", "known", "quarantined"]
    reason: str
    message: str
    found: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class _Upload:
    """Who uploaded a log, and as what."""

    relative: str
    identity: Identity
    fingerprint: str

    @property
    def name(self) -> str:
        return self.relative.rsplit("/", maxsplit=1)[-1]


def take_in(
    candidate: Candidate,
    *,
    batch_date: date,
    store: LocalArtifactStore,
    tables: TableLog,
    settings: IngestSettings,
    anew: bool = False,
) -> TakenIn:
    """Claim an upload, decode it in its child process, and keep it; or refuse it with a reason.

    Args:
        candidate: The upload.
        batch_date: Day of the batch it belongs to.
        store: Where it is kept.
        tables: Where its rows are shown.
        settings: How it is decoded and put on the clock.
        anew: Decode it although its content is known.

    Raises:
        ArtifactError: The machine failed (a full disk, say): never a reason to refuse a log.
    """
    upload = _Upload(
        relative=candidate.relative,
        identity=candidate.identity,
        fingerprint=candidate.fingerprint,
    )
    ledger = InboxLedger(store.layout.ledger)
    try:
        claimed = claim(candidate, staging=store.layout.staging)
    except RefusedClaimError as error:
        refused = ClaimedLog(error.log_id, error.payload or Path(), "")
        return _refuse(error, refused, upload, batch_date=batch_date, store=store)
    known = ledger.status(claimed.log_id)
    if known is not None and not anew:
        _discard(claimed.payload)
        ledger.record(candidate.fingerprint, known)
        return TakenIn(
            name=upload.name,
            log_id=claimed.log_id,
            status="known",
            reason=known.reason,
            message="",
            found=True,
        )
    return _take_in(
        claimed,
        upload,
        batch_date=batch_date,
        store=store,
        tables=tables,
        settings=settings,
        anew=anew,
    )


def take_in_again(
    refused: QuarantinedLog,
    *,
    batch_date: date,
    store: LocalArtifactStore,
    tables: TableLog,
    settings: IngestSettings,
) -> TakenIn:
    """Try a refused log once more, from the copy that quarantine keeps.

    Raises:
        LogError: Nothing of it was kept.
        ArtifactError: The machine failed.
    """
    if refused.payload is None:
        raise LogError(refused.reason, f"nothing was kept of log {refused.log_id}: upload it again")
    # Readers tell a recording by the end of its name.
    copy = store.layout.staging / f"retry-{refused.log_id}{refused.payload.suffix}"
    if refused.payload.is_dir():
        shutil.copytree(refused.payload, copy, dirs_exist_ok=True)
    else:
        shutil.copyfile(refused.payload, copy)
    upload = _Upload(
        relative=refused.relative,
        identity=Identity(refused.site, refused.robot),
        fingerprint=refused.log_id,
    )
    claimed = ClaimedLog(refused.log_id, copy, refused.format)
    taken = _take_in(
        claimed,
        upload,
        batch_date=batch_date,
        store=store,
        tables=tables,
        settings=settings,
        anew=False,
    )
    if taken.status == "new":
        Quarantine(store.layout.quarantine).release(refused.log_id)
    return taken


def _take_in(
    claimed: ClaimedLog,
    upload: _Upload,
    *,
    batch_date: date,
    store: LocalArtifactStore,
    tables: TableLog,
    settings: IngestSettings,
    anew: bool,
) -> TakenIn:
    try:
        made = _materialize(
            claimed, upload, batch_date=batch_date, store=store, settings=settings, anew=anew
        )
    except LogError as error:
        return _refuse(error, claimed, upload, batch_date=batch_date, store=store)
    parts = artifact_parts(store, made.ref, name=claimed.log_id, batch_date=batch_date)
    tables.commit(parts, message=f"log {claimed.log_id}")
    # Last: what the ledger knows is not looked at again.
    _record(upload, LedgerEntry(claimed.log_id, "taken"), store=store)
    _discard(claimed.payload)
    return TakenIn(
        name=upload.name,
        log_id=claimed.log_id,
        status="new",
        reason="",
        message="",
        found=made.found,
    )


def _materialize(
    claimed: ClaimedLog,
    upload: _Upload,
    *,
    batch_date: date,
    store: LocalArtifactStore,
    settings: IngestSettings,
    anew: bool,
) -> Materialized:
    profile = profile_of(upload.identity, upload.name, settings)
    asked: dict[str, JsonValue] = {
        "name": upload.name,
        "robot": upload.identity.robot,
        "site": upload.identity.site,
        "batch_date": batch_date.isoformat(),
        "profile": settings_json(profile),
        "decoder_version": DECODER_VERSION,
        **{
            key: getattr(settings, key)
            for key in ("pose_source", "velocity_source", "step_rate_hz", "gap_s")
        },
    }

    def build(directory: Path) -> None:
        recording, trajectories, counts = _decode(claimed, profile, settings, store)
        if not trajectories:
            raise LogError("empty", "no two poses follow each other: there is no drive in the log")
        description = LogDescription(
            log_id=claimed.log_id,
            name=upload.name,
            robot=upload.identity.robot,
            site=upload.identity.site,
            format=claimed.format,
            batch_date=batch_date,
            profile=profile.name,
            velocity_source=velocity_source(recording, settings),
        )
        write_ingested(directory, description, recording, trajectories, cut_counts=counts)

    log = ArtifactRef("log", claimed.log_id)
    return materialize(store, Recipe(INGEST, asked, inputs=(log,)), build, anew=anew)


def _decode(
    claimed: ClaimedLog,
    profile: RobotProfile,
    settings: IngestSettings,
    store: LocalArtifactStore,
) -> tuple[Recording, list[Trajectory], dict[str, int]]:
    """Decode a log and put it on the clock; also give how often it was cut, by cause."""
    workdir = store.layout.staging
    if claimed.format == TABLES:
        tabled = decode_tables(claimed.payload, limits=settings.limits, workdir=workdir)
        drives = split_drives(tabled, profile=profile, settings=settings)
        # What it was cut by stands among its warnings already.
        return tabled.recording, drives, {}
    recording = decode_log(
        claimed.payload,
        format=claimed.format,
        profile=profile,
        pose_source=settings.pose_source,
        limits=settings.limits,
        workdir=workdir,
    )
    cuts = find_cuts(recording, profile=profile, settings=settings)
    counts = {"dropouts": int(cuts.is_gap.sum()), "pose_jumps": int(cuts.is_jump.sum())}
    return recording, resample(recording, profile=profile, settings=settings), counts


def _refuse(
    error: LogError,
    claimed: ClaimedLog,
    upload: _Upload,
    *,
    batch_date: date,
    store: LocalArtifactStore,
) -> TakenIn:
    kept = Quarantine(store.layout.quarantine).put(
        error,
        log_id=claimed.log_id,
        batch_date=batch_date,
        relative=upload.relative,
        site=upload.identity.site,
        robot=upload.identity.robot,
        format=claimed.format,
        decoder_version=DECODER_VERSION,
        payload=claimed.payload if claimed.payload.name else None,
    )
    _record(upload, LedgerEntry(claimed.log_id, "quarantined", kept.reason), store=store)
    return TakenIn(
        name=upload.name,
        log_id=claimed.log_id,
        status="quarantined",
        reason=kept.reason,
        message=kept.message,
        found=False,
    )


def _record(upload: _Upload, entry: LedgerEntry, *, store: LocalArtifactStore) -> None:
    InboxLedger(store.layout.ledger).record(upload.fingerprint, entry)


def _discard(payload: Path) -> None:
    if payload.is_dir():
        shutil.rmtree(payload, ignore_errors=True)
    else:
        payload.unlink(missing_ok=True)
