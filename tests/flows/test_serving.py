"""Real servers, workers and commands: few tests, in one group, for each start takes seconds."""

import http.client
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from base64 import b64encode
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import UUID

import pytest

from flows.prefect_environment import password_file, without_prefect
from flows.server_announcement import announced_server
from tests.flows.processes import descendants, wait_until_gone

if TYPE_CHECKING:
    from prefect.client.orchestration import SyncPrefectClient

CHECKOUT = Path(__file__).parents[2]
START_LIMIT_S = 180.0

pytestmark = pytest.mark.xdist_group("prefect")


@contextmanager
def running(module: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(
        [sys.executable, "-m", module, *arguments],
        cwd=CHECKOUT,
        env={**without_prefect(os.environ), "PYTHONPATH": str(CHECKOUT)},
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def wait_for(condition: Callable[[], object], *, limit_s: float = START_LIMIT_S) -> None:
    deadline = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.1)


@contextmanager
def serving_naps(root: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    with running("tests.flows.serve_naps", str(root)) as process:
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        assert url, "serve ended before it was ready"
        yield process, url


@contextmanager
def client_of(root: Path, url: str) -> "Iterator[SyncPrefectClient]":
    from prefect.client.orchestration import SyncPrefectClient

    secret = password_file(root).read_text().strip()
    with SyncPrefectClient(f"{url}/api", auth_string=secret) as client:
        yield client


def status_of(url: str, path: str, *, password: str | None = None) -> int:
    headers = {}
    if password is not None:
        headers["Authorization"] = "Basic " + b64encode(password.encode()).decode()
    connection = http.client.HTTPConnection(url.removeprefix("http://"), timeout=30)
    connection.request("GET", path, headers=headers)
    return connection.getresponse().status


@dataclass(frozen=True, slots=True, kw_only=True)
class Killed:
    """A `serve` that was killed while a worker's run slept; `root` is as it left it."""

    root: Path
    run_id: UUID
    below: int
    left: set[int]


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Killed:
    root = tmp_path_factory.mktemp("killed") / "store"
    with serving_naps(root) as (process, url):
        with client_of(root, url) as client:
            deployment = client.read_deployment_by_name("nap/ses")
            run = client.create_flow_run_from_deployment(
                deployment.id, parameters={"seconds": 600.0}
            )
            wait_for(lambda: client.read_flow_run(run.id).state_name == "Running")
        below = descendants(process.pid)
        process.kill()
        left = wait_until_gone(below, limit_s=10.0)
    return Killed(root=root, run_id=run.id, below=len(below), left=left)


@pytest.fixture
def root(killed: Killed, tmp_path: Path) -> Path:
    """A root whose database is made: that takes longer than everything else."""
    shutil.copytree(killed.root, tmp_path / "store")
    return tmp_path / "store"


@dataclass(frozen=True, slots=True, kw_only=True)
class Served:
    """A `serve` that runs, over what the killed one left."""

    root: Path
    url: str


@pytest.fixture(scope="module")
def served(killed: Killed, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    root = tmp_path_factory.mktemp("served") / "store"
    shutil.copytree(killed.root, root)
    with serving_naps(root) as (process, url):
        yield Served(root=root, url=url)
        below = descendants(process.pid)
        began = time.monotonic()
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=15.0) == 0
        assert wait_until_gone(below, limit_s=15.0 - (time.monotonic() - began)) == set()


def test_nothing_outlives_a_killed_serve(killed: Killed) -> None:
    assert killed.below == 3, "expected server, worker and engine"
    assert killed.left == set()
    assert announced_server(killed.root) is None


def test_the_next_serve_ends_the_runs_of_a_killed_one(killed: Killed, served: Served) -> None:
    with client_of(served.root, served.url) as client:
        assert client.read_flow_run(killed.run_id).state_name == "Crashed"


def test_the_server_answers_on_loopback_and_only_with_the_password(
    served: Served,
) -> None:
    root, url = served.root, served.url
    file = password_file(root)

    assert url.startswith("http://127.0.0.1:")
    assert file.stat().st_mode & 0o777 == 0o600
    assert status_of(url, "/api/health") == 200
    assert status_of(url, "/api/admin/version") == 401
    assert status_of(url, "/api/admin/version", password="ses:wrong") == 401
    assert status_of(url, "/api/admin/version", password=file.read_text().strip()) == 200


def test_the_pages_ask_their_own_server(
    served: Served,
) -> None:
    url = served.url
    connection = http.client.HTTPConnection(url.removeprefix("http://"), timeout=30)
    connection.request("GET", "/ui-settings")
    found = json.loads(connection.getresponse().read())

    assert found["api_url"] == f"{url}/api"
    assert found["auth"] == "BASIC"


def test_a_cron_schedule_yields_scheduled_runs(
    served: Served,
) -> None:
    root, url = served.root, served.url

    with client_of(root, url) as client:
        wait_for(lambda: _scheduled(client), limit_s=60.0)
        starts = _scheduled(client)

    # 2 o'clock in Berlin.
    assert all(start.minute == 0 and start.hour in {0, 1} for start in starts)


def _scheduled(client: "SyncPrefectClient") -> list[datetime]:
    runs = client.read_flow_runs()
    times = [run.expected_start_time for run in runs if run.state_name == "Scheduled"]
    return [time for time in times if time is not None]


def test_commands_find_the_server_and_a_second_one_is_refused(
    served: Served,
) -> None:
    root, url = served.root, served.url
    found = announced_server(root)
    assert found is not None
    assert found.address.url == url

    with running("tests.flows.nap_command", "nap", "0", "--root", str(root), "--json") as nap:
        answer = json.loads(nap.communicate(timeout=START_LIMIT_S)[0])
    with running("flows.command_line", "serve", "--root", str(root)) as second:
        status = second.wait(timeout=60.0)

    assert answer["api_url"] == f"{url}/api/"
    assert "Completed" in answer["states"]
    assert status == 2


def test_a_command_records_its_run_and_its_progress_on_a_server_of_its_own(root: Path) -> None:
    with running("tests.flows.nap_command", "nap", "4.5", "--root", str(root), "--json") as nap:
        answer = json.loads(nap.communicate(timeout=START_LIMIT_S)[0])

    assert nap.returncode == 0
    assert answer["states"] == ["Completed"]
    assert answer["artifacts"] == ["progress-train"]


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)]
)
def test_nothing_outlives_an_interrupted_or_killed_command(
    root: Path, number: signal.Signals, status: int
) -> None:
    with running("tests.flows.nap_command", "nap", "600", "--root", str(root)) as nap:
        wait_for(lambda: descendants(nap.pid))
        if number is signal.SIGINT:
            wait_for(lambda: _is_napping(root))
        below = descendants(nap.pid)
        nap.send_signal(number)
        ended = nap.wait(timeout=30.0)

    assert ended == status
    assert wait_until_gone(below, limit_s=10.0) == set()


def _is_napping(root: Path) -> bool:
    with sqlite3.connect(root / "prefect" / "prefect.db") as database:
        (count,) = database.execute(
            "SELECT count(*) FROM flow_run WHERE state_type = 'RUNNING' AND deployment_id IS NULL"
        ).fetchone()
    return bool(count)
