"""What Prefect is told through the environment; it reads it once, when it is imported."""

import contextlib
import os
import secrets
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

LOOPBACK = "127.0.0.1"

CONSOLE = {
    "PREFECT_LOGGING_HANDLERS_CONSOLE_CLASS": "flows.progress_display.ConsoleHandler",
    "PREFECT_LOGGING_FORMATTERS_STANDARD_FLOW_RUN_FMT": "%(asctime)s  %(message)s",
    "PREFECT_LOGGING_FORMATTERS_STANDARD_TASK_RUN_FMT": (
        "%(asctime)s  %(task_run_name)s: %(message)s"
    ),
}
"""Prefect's logging configuration, item by item, for people at a terminal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerAddress:
    """Where a Prefect server listens."""

    host: str = LOOPBACK
    port: int

    @property
    def reachable_host(self) -> str:
        """Address to connect to from this machine."""
        return LOOPBACK if self.host in {"0.0.0.0", "::"} else self.host

    @property
    def url(self) -> str:
        """Address of the user interface."""
        return f"http://{self.reachable_host}:{self.port}"

    @property
    def api_url(self) -> str:
        """Address of the interface that clients use."""
        return f"{self.url}/api"


def prefect_home(root: Path) -> Path:
    """Give the folder of everything Prefect keeps, made for its owner alone."""
    home = root.absolute() / "prefect"
    home.mkdir(mode=0o700, parents=True, exist_ok=True)
    return home


def password_file(root: Path) -> Path:
    """Give the file with what one signs in with: written on first use, for our eyes only."""
    path = prefect_home(root) / "password"
    if not path.exists():
        draft = path.with_name(f".password-{os.getpid()}")
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(descriptor, "w") as file:
            file.write(f"ses:{secrets.token_urlsafe(32)}\n")
        # Of two commands that start together, the first one's password stays.
        with contextlib.suppress(FileExistsError):
            os.link(draft, path)
        draft.unlink()
    return path


def prefect_environment(
    root: Path, address: ServerAddress, *, has_password: bool = True
) -> dict[str, str]:
    """Give the variables for everything that talks to, or is, a root's Prefect server.

    Args:
        root: Of the store; Prefect's database, profiles and logs lie under it.
        address: Of the server. Its own user interface asks this address too: without it the pages
            of a server on any port but 4200 look for their data on port 4200.
        has_password: Whether the server wants the password of `password_file`.
    """
    environment = {
        "PREFECT_HOME": str(prefect_home(root)),
        "PREFECT_API_URL": address.api_url,
        "PREFECT_SERVER_UI_API_URL": address.api_url,
        "PREFECT_SERVER_EPHEMERAL_ENABLED": "false",
        "DO_NOT_TRACK": "1",
        "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
        "PREFECT_SERVER_CSRF_PROTECTION_ENABLED": "true",
        "PREFECT_SERVER_CORS_ALLOWED_ORIGINS": address.url,
        "PREFECT_SERVER_SERVICES_DB_VACUUM_ENABLED": "events,flow_runs",
        # SQLite takes one writer at a time; the default of 10 s fails under a night's load.
        "PREFECT_SERVER_DATABASE_TIMEOUT": "60",
        "PREFECT_LOGGING_TO_API_WHEN_MISSING_FLOW": "ignore",
        "PREFECT_FLOWS_HEARTBEAT_FREQUENCY": "30",
        "PREFECT_WORKER_QUERY_SECONDS": "5",
    }
    if has_password:
        secret = password_file(root).read_text().strip()
        environment["PREFECT_SERVER_API_AUTH_STRING"] = secret
        environment["PREFECT_API_AUTH_STRING"] = secret
    return environment


def without_prefect(inherited: Mapping[str, str]) -> dict[str, str]:
    """Give an environment without another Prefect's variables, save how much is logged."""
    return {
        name: value
        for name, value in inherited.items()
        if not name.startswith("PREFECT_") or name == "PREFECT_LOGGING_LEVEL"
    }


def enter(environment: Mapping[str, str]) -> None:
    """Make this process one of that environment.

    Raises:
        RuntimeError: Prefect is imported already and would not notice.
    """
    if "prefect" in sys.modules:
        raise RuntimeError("prefect was imported before its environment was set")
    kept = without_prefect(os.environ)
    os.environ.clear()
    os.environ.update(kept)
    os.environ.update({**environment, **CONSOLE})
