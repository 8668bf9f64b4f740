import importlib
from pathlib import Path

import yaml

from flows.serve_commands import DEFAULT_CRON
from storage.settings_file import read_settings

DEPLOYMENTS = Path(__file__).parents[2] / "deployments"


def test_the_production_settings_can_be_read() -> None:
    settings = read_settings(DEPLOYMENTS / "ses.toml")

    assert settings.ingest.robots[0].profile == "jackal"


def test_the_prefect_deployment_names_a_flow_and_its_parameters() -> None:
    content = yaml.safe_load((DEPLOYMENTS / "prefect.yaml").read_text())

    (deployment,) = content["deployments"]
    file, _, name = deployment["entrypoint"].partition(":")
    module = importlib.import_module(file.removesuffix(".py").replace("/", "."))
    schema = getattr(module, name).parameters
    assert set(deployment["parameters"]) <= set(schema.properties)
    assert set(schema.required) <= set(deployment["parameters"])
    assert deployment["schedules"][0]["cron"] == DEFAULT_CRON


def test_the_service_calls_ses_serve_with_options_that_exist() -> None:
    import typer.main

    from flows.command_line import app

    (line,) = [
        text
        for text in (DEPLOYMENTS / "ses.service").read_text().splitlines()
        if text.startswith("ExecStart=")
    ]
    group = typer.main.get_command(app)
    serve = group.commands["serve"]  # type: ignore[attr-defined]  # a group by construction
    known = {option for command in (group, serve) for one in command.params for option in one.opts}
    assert {word for word in line.split() if word.startswith("--")} <= known
