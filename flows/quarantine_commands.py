"""`ses quarantine`: refused logs, why, and another try."""

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Annotated

import typer

from flows.command_context import answer_facts, command_context
from flows.progress_display import ProgressDisplay
from ses_core.recipes import JsonValue

if TYPE_CHECKING:
    from storage.quarantine import QuarantinedLog

app = typer.Typer()
quarantine_app = typer.Typer(
    name="quarantine", help="Refused logs.", epilog="Example: ses quarantine list"
)
app.add_typer(quarantine_app)

LogArgument = Annotated[
    str, typer.Argument(metavar="ID", help="Of a refused log, or the beginning of it.")
]


@quarantine_app.command("list", epilog="Example: ses quarantine list --json")
def list_refused(context: typer.Context) -> None:
    """List refused logs with their reasons."""
    from storage.quarantine import REASONS, Quarantine

    command = command_context(context)
    refused = Quarantine(command.existing_store().quarantine).entries()
    if command.is_json:
        command.answer_rows([_row(one) for one in refused], empty="")
        return
    rows: list[dict[str, JsonValue]] = [
        {
            "log_id": one.log_id[:12],
            "batch_date": one.batch_date.isoformat(),
            "name": one.relative,
            "reason": one.reason,
            "meaning": REASONS.get(one.reason, ""),
        }
        for one in refused
    ]
    command.answer_rows(rows, empty="no log is in quarantine")


@quarantine_app.command(epilog="Example: ses quarantine show 3f9a1c")
def show(context: typer.Context, identity: LogArgument) -> None:
    """Say everything that is known of a refused log."""
    from storage.quarantine import Quarantine

    command = command_context(context)
    row = _row(Quarantine(command.existing_store().quarantine).find(identity))
    answer_facts(command, row)


@quarantine_app.command(epilog="Example: ses quarantine retry 3f9a1c")
def retry(
    context: typer.Context,
    identities: Annotated[
        list[str] | None,
        typer.Argument(metavar="[ID]...", help="Refused logs; without any, all that were kept."),
    ] = None,
) -> None:
    """Try refused logs once more, with today's decoder and settings."""
    from storage.artifact_store import LocalArtifactStore
    from storage.ingestion import take_in_again
    from storage.quarantine import Quarantine
    from storage.run_lock import run_lock
    from storage.table_log import TableLog

    command = command_context(context)
    settings = command.settings().ingest
    store = LocalArtifactStore(command.existing_store().root)
    quarantine = Quarantine(store.layout.quarantine)
    kept = [one for one in quarantine.entries() if one.payload is not None]
    chosen = [quarantine.find(identity) for identity in identities] if identities else kept
    display = ProgressDisplay()
    rows: list[dict[str, JsonValue]] = []
    with run_lock(store.layout, purpose="ses quarantine retry"):
        tables = TableLog(store.layout)
        for done, refused in enumerate(chosen, start=1):
            taken = take_in_again(
                refused,
                batch_date=datetime.now(UTC).date(),
                store=store,
                tables=tables,
                settings=settings,
            )
            rows.append(
                {
                    "log_id": taken.log_id,
                    "name": taken.name,
                    "status": taken.status,
                    "reason": taken.reason,
                    "message": taken.message,
                }
            )
            display.update("retry", done / len(chosen))
    command.answer_rows(rows, empty="no log is in quarantine")


def _row(refused: "QuarantinedLog") -> dict[str, JsonValue]:
    from storage.quarantine import REASONS

    return {
        "log_id": refused.log_id,
        "batch_date": refused.batch_date.isoformat(),
        "name": refused.relative,
        "site": refused.site,
        "robot": refused.robot,
        "format": refused.format,
        "reason": refused.reason,
        "meaning": REASONS.get(refused.reason, ""),
        "message": refused.message,
        "kept": str(refused.payload) if refused.payload else None,
    }
