"""What one day's nights produced: stages built and found, logs taken and refused, and why."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import date
from typing import Literal, cast

from ses_core.errors import ArtifactError
from ses_core.recipes import JsonValue, digest_json
from storage.durable_files import replace_file
from storage.layout import Layout
from storage.sealed_json import seal, unseal


@dataclass(frozen=True, slots=True, kw_only=True)
class LogRecord:
    """What became of one log of the inbox.

    Attributes:
        reason: Why it was refused; empty where it was taken.
    """

    name: str
    log_id: str
    status: Literal["new", "known", "quarantined"]
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class StageRecord:
    """What one stage did.

    Attributes:
        built: Artifacts it built.
        found: Artifacts that were there already.
        artifacts: References of both.
    """

    stage: str
    built: int
    found: int
    seconds: float
    artifacts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRecord:
    """What one night did.

    Attributes:
        summary: What `ses nightly --json` prints, as JSON values.
    """

    run_id: str
    started_stamp_ns: int
    seconds: float
    logs: tuple[LogRecord, ...]
    stages: tuple[StageRecord, ...]
    decision: str
    champion: str
    summary: dict[str, JsonValue]


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchManifest:
    """All nights of one day, in the order in which they first ran."""

    batch_date: date
    runs: tuple[RunRecord, ...]


def make_run_id(batch_date: date, asked: Sequence[str]) -> str:
    """Name a night by its day and what it was asked: asked again, it has the same name."""
    return f"{batch_date.isoformat()}-{digest_json(list(asked))[:8]}"


def record_run(layout: Layout, batch_date: date, run: RunRecord) -> BatchManifest:
    """Write a run into its day's manifest, in place of an earlier one of the same name.

    Raises:
        ArtifactError: The disk is full or failing; the manifest is then as it was.
    """
    try:
        known = read_manifest(layout, batch_date)
    except ArtifactError:
        known = None  # Damaged: a history of convenience, not worth losing the night for.
    runs = {record.run_id: record for record in known.runs} if known else {}
    runs[run.run_id] = run
    manifest = BatchManifest(batch_date=batch_date, runs=tuple(runs.values()))
    value: dict[str, JsonValue] = {
        "batch_date": batch_date.isoformat(),
        "runs": [cast("JsonValue", asdict(record)) for record in manifest.runs],
    }
    replace_file(layout.batch_file(batch_date), seal(value))
    return manifest


def read_manifest(layout: Layout, batch_date: date) -> BatchManifest | None:
    """Read a day's manifest, or None where no night ran that day.

    Raises:
        ArtifactError: It is damaged.
    """
    path = layout.batch_file(batch_date)
    if not path.exists():
        return None
    value = unseal(path.read_bytes(), source=path)
    runs = cast("list[dict[str, JsonValue]]", value["runs"])
    return BatchManifest(batch_date=batch_date, runs=tuple(map(_run, runs)))


def batch_dates(layout: Layout) -> list[date]:
    """List the days that have a manifest, oldest first."""
    return sorted(date.fromisoformat(path.stem) for path in layout.batches.glob("[0-9]*.json"))


def _run(value: dict[str, JsonValue]) -> RunRecord:
    logs = cast("list[dict[str, str]]", value["logs"])
    stages = cast("list[dict[str, JsonValue]]", value["stages"])
    return RunRecord(
        run_id=str(value["run_id"]),
        started_stamp_ns=int(str(value["started_stamp_ns"])),
        seconds=float(str(value["seconds"])),
        logs=tuple(
            LogRecord(
                name=log["name"],
                log_id=log["log_id"],
                status=cast("Literal['new', 'known', 'quarantined']", log["status"]),
                reason=log["reason"],
            )
            for log in logs
        ),
        stages=tuple(
            StageRecord(
                stage=str(stage["stage"]),
                built=int(str(stage["built"])),
                found=int(str(stage["found"])),
                seconds=float(str(stage["seconds"])),
                artifacts=tuple(cast("list[str]", stage["artifacts"])),
            )
            for stage in stages
        ),
        decision=str(value["decision"]),
        champion=str(value["champion"]),
        summary=cast("dict[str, JsonValue]", value["summary"]),
    )
