"""`ses nap SECONDS`: a command that runs a flow; prints the runs that the server then knows."""

from typing import Annotated

import typer

from flows.command_context import command_context
from flows.command_line import app, main
from flows.prefect_server import embedded_server
from ses_core.recipes import JsonValue


@app.command(name="nap")
def nap_command(context: typer.Context, seconds: Annotated[float, typer.Argument()]) -> None:
    command = command_context(context)
    with embedded_server(command.root):
        from prefect.client.orchestration import get_client

        from tests.flows.sample_flows import nap

        slept = nap(seconds)
        with get_client(sync_client=True) as client:
            runs = [run for run in client.read_flow_runs() if run.deployment_id is None]
            artifacts = client.read_artifacts()
            api_url = str(client.api_url)
    answer: dict[str, JsonValue] = {
        "slept": slept,
        "states": [run.state_name for run in runs],
        "artifacts": [artifact.key for artifact in artifacts if artifact.flow_run_id == runs[0].id],
        "api_url": api_url,
    }
    command.answer(answer, lambda: f"slept {slept} s")


if __name__ == "__main__":
    main()
