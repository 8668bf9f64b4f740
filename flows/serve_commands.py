"""`ses serve`."""

import ipaddress
import signal
import threading
from pathlib import Path
from typing import Annotated

import typer

from flows.command_arguments import existing_directory
from flows.command_context import command_context
from ses_core.recipes import JsonValue

app = typer.Typer()

DEFAULT_CRON = "0 2 * * *"


@app.command(
    epilog="Example: ses serve --inbox /data/logs --cron '30 2 * * *' --timezone Europe/Berlin"
)
def serve(
    context: typer.Context,
    inbox: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of robot logs; else 'inbox' under the root."),
    ] = None,
    cron: Annotated[str, typer.Option(help="When a night starts by itself.")] = DEFAULT_CRON,
    timezone: Annotated[str, typer.Option(help="In which the schedule is read.")] = "UTC",
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes a free one.")
    ] = 4200,
    password: Annotated[
        bool, typer.Option(help="Ask for the password in the root's password file.")
    ] = True,
) -> None:
    """Run a Prefect server, a worker and the nightly schedule until stopped."""
    from flows.prefect_environment import ServerAddress, password_file
    from flows.serving import ServedFlow
    from flows.serving import serve as serve_flows

    command = command_context(context)
    _check_schedule(cron, timezone)
    if not password and not _is_loopback(host):
        raise typer.BadParameter(
            f"found {host} without a password, expected 127.0.0.1: whoever reaches the server "
            "can run code on this machine",
            param_hint="--host",
        )
    if inbox is None:
        inbox = command.root / "inbox"
        inbox.mkdir(parents=True, exist_ok=True)
    parameters: dict[str, JsonValue] = {
        "inbox": str(existing_directory(inbox, "--inbox")),
        "root": str(command.root),
        "settings": command.settings().model_dump(mode="json"),
    }

    def ready(address: ServerAddress) -> None:
        secret = str(password_file(command.root)) if password else None
        sign_in = f"sign in with the line in {secret}" if secret else "no password is asked for"
        command.answer(
            {"url": address.url, "password_file": secret, "cron": cron, "timezone": timezone},
            lambda: f"{address.url}\n{sign_in}\nnext nights: {cron} ({timezone}) from {inbox}",
        )

    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    serve_flows(
        command.root,
        [
            ServedFlow(
                module="flows.nightly_batch",
                function="nightly",
                cron=cron,
                timezone=timezone,
                parameters=parameters,
            )
        ],
        host=host,
        port=port,
        has_password=password,
        ready=ready,
        stop=stop,
    )


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _check_schedule(cron: str, timezone: str) -> None:
    from zoneinfo import available_timezones

    if len(cron.split()) != 5:
        raise typer.BadParameter(
            f"found {cron!r}, expected five fields as in '{DEFAULT_CRON}'", param_hint="--cron"
        )
    if timezone not in available_timezones():
        raise typer.BadParameter(
            f"found {timezone!r}, expected a name as Europe/Berlin", param_hint="--timezone"
        )
