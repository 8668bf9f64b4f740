"""`ses status`, `ses verify` and `ses gc`: the store."""

from datetime import UTC, datetime
from typing import Annotated

import typer

from flows.command_context import aligned, command_context
from ses_core.recipes import JsonValue

app = typer.Typer()


@app.command(epilog="Example: ses status --root /data/ses")
def status(context: typer.Context) -> None:
    """Say what the store holds, what the last night did, and whether one runs now."""
    from storage.batch_manifest import batch_dates, read_manifest
    from storage.disk_space import free_bytes
    from storage.policy_registry import PolicyRegistry
    from storage.run_lock import lock_holder
    from storage.table_log import TableLog
    from storage.table_schemas import TABLES

    command = command_context(context)
    layout = command.existing_store()
    log = TableLog(layout)
    tables: dict[str, JsonValue] = {
        table: sum(part.rows for part in log.parts(table)) for table in TABLES
    }
    days = batch_dates(layout)
    manifest = read_manifest(layout, days[-1]) if days else None
    last = manifest.runs[-1] if manifest and manifest.runs else None
    champion = PolicyRegistry(layout).champion()
    found: dict[str, JsonValue] = {
        "root": str(layout.root),
        "rows": tables,
        "nights": len(days),
        "last_run": last.run_id if last else None,
        "last_decision": last.decision if last else None,
        "champion": champion.policy_id if champion else None,
        "in_use_by": lock_holder(layout),
        "free_mib": free_bytes(layout.root) >> 20,
    }
    rows = [
        *({"what": key, "value": value} for key, value in found.items() if key != "rows"),
        *({"what": f"{table} (rows)", "value": count} for table, count in tables.items()),
    ]
    command.answer(found, lambda: aligned(rows))


@app.command(epilog="Example: ses verify --repair")
def verify(
    context: typer.Context,
    repair: Annotated[
        bool, typer.Option("--repair", help="Mend what can be; the next night rebuilds the rest.")
    ] = False,
) -> None:
    """Check every byte of the store against its digest."""
    from storage.verification import Damage
    from storage.verification import verify as verify_store

    command = command_context(context)
    result = verify_store(command.existing_store(), repair=repair)
    found: dict[str, JsonValue] = {
        "artifacts": result.artifacts,
        "recipes": result.recipes,
        "entries": result.entries,
        "parts": result.parts,
        "corrupt": result.count(Damage.CORRUPT),
        "missing": result.count(Damage.MISSING),
        "foreign": result.count(Damage.FOREIGN),
        "repaired": sum(finding.repaired for finding in result.findings),
        "findings": [finding.text for finding in result.findings],
    }

    def text() -> str:
        checked = (
            f"checked {result.artifacts} artifacts, {result.recipes} recipes, "
            f"{result.entries} log entries, {result.parts} table parts"
        )
        lines = [
            f"{'repaired' if finding.repaired else 'found'}: {finding.text}"
            for finding in result.findings
        ]
        return "\n".join([*lines, checked, "" if lines else "nothing is wrong"]).rstrip()

    command.answer(found, text)
    if result.damage:
        raise typer.Exit(1)


@app.command(epilog="Example: ses gc")
def gc(context: typer.Context) -> None:
    """Take away what nobody needs any more: half-built things, old scans, disposable artifacts."""
    from storage.garbage_collection import collect_garbage

    command = command_context(context)
    collected = collect_garbage(
        command.existing_store(), now=datetime.now(UTC), keep=command.settings().store
    )
    found: dict[str, JsonValue] = {
        "temporaries": collected.temporaries,
        "recipes": collected.recipes,
        "objects": collected.objects,
        "scan_parts": collected.scan_parts,
        "freed_bytes": collected.freed_bytes,
    }
    command.answer(found, lambda: aligned([found]))
