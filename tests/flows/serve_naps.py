"""`serve_naps ROOT`: what `ses serve` does, with a flow that sleeps in place of the night."""

import signal
import sys
import threading
from pathlib import Path

import typer

from flows.serving import ServedFlow, serve


def main() -> None:
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    naps = ServedFlow(
        module="tests.flows.sample_flows",
        function="nap",
        cron="0 2 * * *",
        timezone="Europe/Berlin",
        parameters={"seconds": 0.0},
    )
    serve(
        Path(sys.argv[1]),
        [naps],
        host="127.0.0.1",
        port=0,
        has_password=True,
        ready=lambda address: typer.echo(address.url),
        stop=stop,
    )


if __name__ == "__main__":
    main()
