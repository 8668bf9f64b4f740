"""`ses champion`, `promote`, `rollback`, `explain`: which policy drives, and where it came from."""

from typing import TYPE_CHECKING, Annotated

import typer

from flows.command_context import command_context
from ses_core.recipes import JsonValue

if TYPE_CHECKING:
    from storage.policy_registry import RegistryEntry

app = typer.Typer()

REFUSED = 3
NO_GATE = "there is no gate yet: nights report, and nothing is promoted"

RunArgument = Annotated[str, typer.Argument(metavar="RUN", help="A night's run id.")]


@app.command(epilog="Example: ses champion")
def champion(context: typer.Context) -> None:
    """List every change of the champion, the newest last."""
    from storage.policy_registry import PolicyRegistry

    command = command_context(context)
    history = PolicyRegistry(command.existing_store()).history()
    command.answer_rows(
        [_row(entry) for entry in history],
        empty="no champion: nights train from the original policy until one is promoted",
    )


@app.command(epilog="Example: ses promote 2026-11-22-0a1b2c3d")
def promote(context: typer.Context, run: RunArgument) -> None:
    """Ask for a night's policy to become the champion; the gate decides."""
    from storage.lineage import find_run

    command = command_context(context)
    if find_run(command.existing_store(), run) is None:
        raise typer.BadParameter(
            f"found {run!r}, expected the run id of a night (see ses status)", param_hint="RUN"
        )
    command.answer({"run_id": run, "promoted": False, "reason": NO_GATE}, lambda: "")
    typer.echo(f"ses promote: {run} is not promoted: {NO_GATE}", err=True)
    raise typer.Exit(REFUSED)


@app.command(epilog="Example: ses rollback --reason 'scrapes doors in building 3'")
def rollback(
    context: typer.Context,
    reason: Annotated[str, typer.Option(help="For the log.")] = "asked for on the command line",
) -> None:
    """Bring back the champion before the present one."""
    from storage.policy_registry import PolicyRegistry

    command = command_context(context)
    entry = PolicyRegistry(command.existing_store()).rollback(reason=reason)
    command.answer_rows([_row(entry)], empty="")


@app.command(epilog="Example: ses explain 2026-11-22-0a1b2c3d")
def explain(
    context: typer.Context,
    identity: Annotated[
        str,
        typer.Argument(metavar="ID", help="Of a night, policy, environment, scenario or log."),
    ],
) -> None:
    """Say what something was made from and what was made from it."""
    from storage.lineage import explain as explain_identity

    command = command_context(context)
    rows = explain_identity(command.existing_store(), identity)
    if not rows:
        raise typer.BadParameter(
            f"found {identity!r}, expected the id of a night, policy, environment, scenario or log",
            param_hint="ID",
        )
    command.answer_rows(rows, empty="")


def _row(entry: "RegistryEntry") -> dict[str, JsonValue]:
    return {
        "number": entry.number,
        "action": entry.action,
        "policy_id": entry.policy_id or None,
        "policy": str(entry.policy) if entry.policy else None,
        "run_id": entry.run_id or None,
        "restores": entry.restores or None,
        "replaces": entry.replaces or None,
        "reason": entry.reason,
        "created_stamp_ns": entry.created_stamp_ns,
    }
