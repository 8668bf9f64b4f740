"""`ses serve`: a Prefect server, a worker and the scheduled flows, all under one root."""

import importlib
import subprocess
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from flows.child_process import PARENT_VARIABLE, child_command, start_child, stop_child
from flows.prefect_environment import ServerAddress, enter, prefect_home
from flows.prefect_server import RunningServer, ServerError, start_server
from flows.server_announcement import Announcement, announce, the_only_one
from ses_core.errors import SettingsError
from ses_core.recipes import JsonValue

WORK_POOL = "ses"


@dataclass(frozen=True, slots=True, kw_only=True)
class ServedFlow:
    """A flow that people start in the Prefect UI, and that may start by itself.

    Attributes:
        module: Where it is defined.
        function: Its name there.
        cron: When it starts by itself, or None.
        timezone: In which `cron` is read, e.g. Europe/Berlin.
        parameters: What the form is filled in with, and what a scheduled run gets.
    """

    module: str
    function: str
    cron: str | None = None
    timezone: str = "UTC"
    parameters: Mapping[str, JsonValue] = field(default_factory=dict)


def serve(
    root: Path,
    flows: Sequence[ServedFlow],
    *,
    host: str,
    port: int,
    has_password: bool,
    ready: Callable[[ServerAddress], None],
    stop: threading.Event,
) -> None:
    """Serve flows until told to stop, then end everything that was started, within 15 s.

    Args:
        root: Of the store.
        flows: What to offer.
        host: Address to listen on.
        port: Port to listen on; 0 takes a free one.
        has_password: Whether the server asks for the root's password.
        ready: Called once when server, schedule and worker stand.
        stop: Set by whoever wants it to end.

    Raises:
        SettingsError: The root is served already, or the address cannot be listened on.
        ServerError: Server or worker ended by themselves.
    """
    with the_only_one(root) as descriptor:
        server = start_server(
            root, kind="scheduling", host=host, port=port, has_password=has_password
        )
        worker: subprocess.Popen[bytes] | None = None
        try:
            enter(server.environment)
            server.wait_until_healthy()
            offer(flows, prefect_home(root))
            end_lost_runs()
            worker = _start_worker(root, server)
            announce(descriptor, Announcement(address=server.address, has_password=has_password))
            ready(server.address)
            while not stop.wait(0.5):
                _check("server", server.process, server.log)
                _check("worker", worker, _worker_log(root))
        finally:
            if worker is not None:
                stop_child(worker, patience_s=6.0)
                if server.process.poll() is None:
                    end_lost_runs()
            server.stop()


def offer(flows: Sequence[ServedFlow], directory: Path) -> None:
    """Create the work pool and one Prefect deployment per flow, or update them.

    Args:
        flows: What to offer; a flow's other deployments are left alone.
        directory: Working directory of the runs.

    Raises:
        SettingsError: A schedule cannot be read.
    """
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.actions import WorkPoolCreate
    from prefect.client.schemas.objects import ConcurrencyLimitConfig, ConcurrencyLimitStrategy
    from prefect.deployments.runner import RunnerDeployment
    from prefect.flows import Flow
    from prefect.schedules import Cron
    from prefect.types.entrypoint import EntrypointType
    from prefect.workers.process import ProcessWorker

    with get_client(sync_client=True) as client:
        client.create_work_pool(
            WorkPoolCreate(
                name=WORK_POOL,
                type=ProcessWorker.type,
                base_job_template=ProcessWorker.get_default_base_job_template(),
            ),
            overwrite=True,
        )
    engine = subprocess.list2cmdline(child_command("prefect.engine"))
    for served in flows:
        flow: Flow[..., object] = getattr(importlib.import_module(served.module), served.function)
        try:
            schedules = [Cron(served.cron, timezone=served.timezone)] if served.cron else []
        except ValueError as error:
            raise SettingsError(
                f"found schedule {served.cron!r} ({served.timezone}), expected a cron expression "
                "as '0 2 * * *'"
            ) from error
        # The annotation of the plain call also allows for a coroutine, which from_flow never gives.
        deployment = RunnerDeployment.from_flow(
            flow,
            name="ses",
            schedules=schedules,
            parameters=dict(served.parameters),
            description=flow.description,
            # A night that is not over when the next one is due goes on; the next one is dropped.
            concurrency_limit=ConcurrencyLimitConfig(
                limit=1, collision_strategy=ConcurrencyLimitStrategy.CANCEL_NEW
            ),
            work_pool_name=WORK_POOL,
            job_variables={"command": engine, "working_dir": str(directory)},
            entrypoint_type=EntrypointType.MODULE_PATH,
        )
        deployment.apply()


def end_lost_runs() -> int:
    """Mark runs as crashed that a worker started and that nobody can be working on.

    To be called while no worker runs. A run whose worker was killed stays PENDING or RUNNING for
    ever otherwise, and with one run at a time it would keep every later night from starting.

    Returns:
        How many there were.
    """
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.filters import (
        FlowRunFilter,
        FlowRunFilterDeploymentId,
        FlowRunFilterState,
        FlowRunFilterStateType,
    )
    from prefect.client.schemas.objects import StateType
    from prefect.states import Crashed

    unfinished = FlowRunFilter(
        deployment_id=FlowRunFilterDeploymentId(is_null_=False),
        state=FlowRunFilterState(
            type=FlowRunFilterStateType(
                any_=[StateType.PENDING, StateType.RUNNING, StateType.CANCELLING]
            )
        ),
    )
    with get_client(sync_client=True) as client:
        lost = client.read_flow_runs(flow_run_filter=unfinished)
        for run in lost:
            client.set_flow_run_state(
                run.id, Crashed(message="the worker that ran it has ended"), force=True
            )
    return len(lost)


def _start_worker(root: Path, server: RunningServer) -> subprocess.Popen[bytes]:
    arguments = ["worker", "start", "--pool", WORK_POOL, "--type", "process", "--name", "ses"]
    environment = {
        name: value for name, value in server.environment.items() if name != PARENT_VARIABLE
    }
    return start_child("prefect", arguments, environment=environment, log=_worker_log(root))


def _worker_log(root: Path) -> Path:
    return prefect_home(root) / "worker.log"


def _check(name: str, child: subprocess.Popen[bytes], log: Path) -> None:
    status = child.poll()
    if status is not None:
        raise ServerError(f"prefect {name} ended with status {status}, expected it to stay: {log}")
