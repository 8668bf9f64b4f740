"""A Prefect server as our own child: started, waited for, found again, ended."""

import http.client
import os
import socket
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from flows.child_process import start_child, stop_child
from flows.prefect_environment import (
    LOOPBACK,
    ServerAddress,
    enter,
    prefect_environment,
    prefect_home,
    without_prefect,
)
from flows.server_announcement import announced_server
from ses_core.errors import SesError, SettingsError

START_LIMIT_S = 180.0
"""A first start migrates the database: 13 s on an idle machine, far more on a busy one."""

SEND_LIMIT_S = 5.0


class ServerError(SesError):
    """The Prefect server did not start, or ended before its time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunningServer:
    """A server that is our child."""

    address: ServerAddress
    environment: Mapping[str, str]
    process: subprocess.Popen[bytes]
    log: Path

    def wait_until_healthy(self, limit_s: float = START_LIMIT_S) -> None:
        """Return when the server answers.

        Raises:
            ServerError: It ended, or said nothing within the limit.
        """
        deadline = time.monotonic() + limit_s
        while not is_healthy(self.address):
            if (status := self.process.poll()) is not None:
                raise ServerError(
                    f"prefect server ended with status {status} while starting, expected it to "
                    f"answer on {self.address.url}: {_last_line(self.log)} (log {self.log})"
                )
            if time.monotonic() > deadline:
                raise ServerError(
                    f"prefect server said nothing for {limit_s:.0f} s, expected it to answer on "
                    f"{self.address.url} (log {self.log})"
                )
            time.sleep(0.05)

    def stop(self, *, patience_s: float = 4.0) -> None:
        """End the server."""
        stop_child(self.process, patience_s=patience_s)


def is_healthy(address: ServerAddress, *, timeout_s: float = 2.0) -> bool:
    """Say whether a Prefect server answers at an address."""
    # Not urllib: it would ask a proxy that the environment names for our own loopback.
    connection = http.client.HTTPConnection(address.reachable_host, address.port, timeout=timeout_s)
    try:
        connection.request("GET", "/api/health")
        return connection.getresponse().read() == b"true"
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()


def start_server(
    root: Path,
    *,
    kind: Literal["private", "scheduling"],
    host: str = LOOPBACK,
    port: int = 0,
    has_password: bool = True,
) -> RunningServer:
    """Start a server over a root's database, without waiting for it.

    Args:
        root: Of the store.
        kind: `private` keeps the record of one command's runs; `scheduling` also has the user
            interface and starts what is due.
        host: Address to listen on.
        port: Port to listen on; 0 takes a free one.
        has_password: Whether it asks for the password in `password_file`.

    Raises:
        SettingsError: The address cannot be listened on.
    """
    try:
        listener = socket.create_server((host, port))
    except OSError as error:
        raise SettingsError(
            f"cannot listen on {host}:{port}: {error.strerror}, expected a free port (0 takes any)"
        ) from error
    address = ServerAddress(host=host, port=listener.getsockname()[1])
    environment = without_prefect(os.environ)
    environment |= prefect_environment(root, address, has_password=has_password)
    log = prefect_home(root) / "server.log"
    with listener:
        process = start_child(
            "flows.server_process",
            [str(listener.fileno()), kind],
            environment=environment,
            log=log,
            pass_fds=[listener.fileno()],
        )
    return RunningServer(address=address, environment=environment, process=process, log=log)


@contextmanager
def embedded_server(root: Path) -> Iterator[None]:
    """Have a Prefect server while a command runs, and make this process its client.

    The server that `PREFECT_API_URL` names, or that of `ses serve` where one runs for this root;
    else a private one, which starts while this process imports Prefect.

    Raises:
        ServerError: It does not start.
    """
    if "PREFECT_API_URL" in os.environ:
        yield
        return
    announced = announced_server(root)
    if announced is not None:
        enter(prefect_environment(root, announced.address, has_password=announced.has_password))
        yield
        return
    server = start_server(root, kind="private")
    try:
        enter(prefect_environment(root, server.address))
        import prefect  # noqa: F401 - while the server starts

        server.wait_until_healthy()
        yield
        _send_what_is_queued()
    finally:
        server.stop()


def _send_what_is_queued() -> None:
    """Send the logs and events of our runs while there is a server for them.

    Prefect sends them in the background, and at exit tries for minutes to reach a server that has
    ended.
    """
    from prefect.events.worker import EventsWorker
    from prefect.logging.handlers import APILogWorker

    APILogWorker.drain_all(timeout=SEND_LIMIT_S)
    EventsWorker.drain_all(timeout=SEND_LIMIT_S)


def _last_line(log: Path) -> str:
    lines = log.read_text(errors="replace").split("\n")
    return next((line.strip() for line in reversed(lines) if line.strip()), "it said nothing")
