"""`ses show`: a picture and the facts of a log, a scenario, an environment or an episode."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer._click.core import Context  # see flows/command_arguments.py on typer's own parser
from typer.core import TyperCommand

from flows import episode_commands
from flows.command_context import aligned, command_context
from flows.id_lookup import TABLES, find_row
from ses_core.recipes import JsonValue

if TYPE_CHECKING:
    from ses_core.settings import Settings
    from storage.layout import Layout

app = typer.Typer()

IdArgument = Annotated[
    str,
    typer.Argument(metavar="ID", help="Of a scenario, an environment or a log, or its beginning."),
]
EPISODE = "episode"
UNSHOWN = ("cells", "observed")


class ShowCommand(TyperCommand):
    """`ses show ID`; what follows `ses show episode` is a command of its own."""

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: Context | None = None,
        **extra: Any,
    ) -> Context:
        """Prepare the command that the first argument asks for."""
        if args[:1] == [EPISODE]:
            command = typer.main.get_command(episode_commands.app)
            return command.make_context(f"{info_name} {EPISODE}", args[1:], parent, **extra)
        return super().make_context(info_name, args, parent, **extra)


@app.command(
    cls=ShowCommand,
    epilog="Example: ses show 0f3c9a51d2b7e864 --out scenario.png "
    "(an evaluation's trial: ses show episode --help)",
)
def show(
    context: typer.Context,
    identity: IdArgument,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Draw it there; else <ID>.png.")
    ] = None,
) -> None:
    """Draw a scenario with its scans and its place, an environment, or a whole log."""
    from storage.durable_files import replace_file

    command = command_context(context)
    layout = command.existing_store()
    table, row = find_row(layout, identity)
    identity = str(row[TABLES[table]])
    target = (out or Path(f"{identity}.png")).absolute()
    picture = draw(layout, table, row, command.settings())
    target.parent.mkdir(parents=True, exist_ok=True)
    replace_file(target, picture)
    facts = {name: value for name, value in row.items() if name not in UNSHOWN}
    facts["picture"] = str(target)
    listed: list[dict[str, JsonValue]] = [{"what": key, "value": facts[key]} for key in facts]
    command.answer([facts], lambda: aligned(listed))


def draw(layout: "Layout", table: str, row: Mapping[str, JsonValue], settings: "Settings") -> bytes:
    """Draw what a row describes, as PNG."""
    if table == "environments" and not row["scenario_id"]:
        from ses_core.pictures.environment_figure import environment_figure
        from storage.scenario_tables import environments_of
        from storage.table_reader import open_table

        rows = open_table(layout.root, "environments")
        (environment,) = environments_of(rows[rows["environment_id"] == row["environment_id"]])
        return environment_figure(environment, target=settings.target_robot)
    return _draw_recorded(layout, row, settings)


def _draw_recorded(layout: "Layout", row: Mapping[str, JsonValue], settings: "Settings") -> bytes:
    """Draw a log, or the scenario that a row of scenarios or environments is of."""
    from ses_core.pictures.log_figure import log_figure
    from ses_core.pictures.scenario_figure import scenario_figure
    from storage.shown_logs import read_shown_log
    from storage.table_reader import open_table

    log_id = row.get("log_id")
    scenario_id = row.get("scenario_id")
    if log_id is None:
        scenarios = open_table(layout.root, "scenarios", columns=["scenario_id", "log_id"])
        log_id = scenarios.loc[scenarios["scenario_id"] == scenario_id, "log_id"].iloc[0]
    log = read_shown_log(layout, str(log_id), settings=settings)
    if scenario_id is None:
        return log_figure(log.extracted, log.trajectories, title=log.name)
    extracted, trajectory = log.scenario(str(scenario_id))
    return scenario_figure(
        extracted,
        trajectory,
        target=settings.target_robot,
        scan_margin=settings.extraction.scan_margin_s,
    )
