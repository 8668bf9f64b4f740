"""`ses export`: environments, worlds and scenarios in the formats that other tools read."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from flows.command_arguments import existing_path, misuse
from flows.command_context import CommandContext, command_context
from flows.id_lookup import find_row, pick_id
from flows.shared_options import PartOption, ResolutionOption

if TYPE_CHECKING:
    from ses_core.navigation import NavigationEnvironment
    from ses_core.place import Place
    from storage.layout import Layout

app = typer.Typer()

ExportFormat = Literal["sdf", "map-server", "png", "npz", "mcap"]

SUFFIXES: dict[ExportFormat, tuple[str, ...]] = {
    "sdf": (".world", ".sdf"),
    "map-server": (".yaml", ".yml"),
    "png": (".png",),
    "npz": (".npz",),
    "mcap": (".mcap",),
}
"""What a format's files are called; a name without any of it gets the first."""


@app.command(epilog="Example: ses export 0f3c9a51 --format sdf --out place.world")
def export(
    context: typer.Context,
    identity: Annotated[
        str,
        typer.Argument(
            metavar="ID", help="Of an environment, a scenario or a world, or its beginning."
        ),
    ],
    export_format: Annotated[
        ExportFormat,
        typer.Option(
            "--format",
            help="Gazebo world; map_server YAML with PGM; one pixel per cell; numpy arrays; "
            "ROS 2 messages for Foxglove.",
        ),
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="File to write.")],
    worlds: Annotated[
        list[Path] | None,
        typer.Option(
            "--worlds",
            metavar="PATH",
            help="The id is of a world in this set, map or folder; may be repeated.",
            callback=lambda paths: paths and [existing_path(path, "--worlds") for path in paths],
        ),
    ] = None,
    environments: Annotated[
        Path | None,
        typer.Option(
            "--environments",
            metavar="DIR",
            help="The id is of an environment that `ses synthesize` wrote there.",
            callback=lambda path: path and existing_path(path, "--environments"),
        ),
    ] = None,
    part: PartOption = None,
    resolution: ResolutionOption = None,
    course: Annotated[
        bool,
        typer.Option(
            "--course",
            help="An environment as policies are trained in it: sides closed, 1 m of open apron "
            "at both ends.",
        ),
    ] = False,
) -> None:
    """Write an environment, a scenario's place, a scenario or a world for other tools.

    A scenario's own drive is in mcap; in the other formats it stands for the place that was
    rebuilt of it. Coordinates are those of the scenario: start at the origin, x to the goal.
    """
    command = command_context(context)
    path = _target(out, export_format)
    if worlds and environments:
        raise typer.BadParameter(
            "found --worlds too, expected one place to look the id up in",
            param_hint="--environments",
        )
    if not worlds:
        _refuse_lone(part=part, resolution=resolution)
    if worlds:
        if course:
            raise typer.BadParameter(
                "found a world, expected an environment", param_hint="--course"
            )
        place = _world(identity, worlds, part=part, resolution=resolution)
        _write_place(path, place, export_format)
    elif environments:
        environment = _listed_environment(identity, environments)
        _write_place(path, _place(environment, course=course), export_format)
    else:
        _export_stored(command, identity, path, export_format, course=course)
    command.answer({"path": str(path)}, lambda: str(path))


def _refuse_lone(*, part: str | None, resolution: float | None) -> None:
    """Refuse options that say how worlds are read where there are none."""
    for option, value in (("--part", part), ("--resolution", resolution)):
        if value is not None:
            raise typer.BadParameter(
                f"found {value} without --worlds, expected worlds to read by it", param_hint=option
            )


def _target(out: Path, export_format: ExportFormat) -> Path:
    """Give the file to write, under a name that other tools know the format by.

    Raises:
        typer.BadParameter: It has another format's name, or is a folder.
    """
    suffixes = SUFFIXES[export_format]
    path = out.absolute()
    if not path.suffix:
        path = path.with_name(path.name + suffixes[0])
    if path.suffix.lower() not in suffixes:
        raise typer.BadParameter(
            f"found {out.name}, expected a name that ends in {' or '.join(suffixes)} for "
            f"{export_format}",
            param_hint="--out",
        )
    if path.is_dir():
        raise typer.BadParameter(f"found a folder at {path}, expected a file", param_hint="--out")
    return path


def _world(
    identity: str, paths: list[Path], *, part: str | None, resolution: float | None
) -> "Place":
    """Find a world by its id, its beginning, or its name if no other world has that name."""
    from ses_core.place import place_of_world
    from storage.world_sets import read_worlds

    with misuse("--worlds"):
        found = read_worlds(paths, part=part, resolution=resolution)
    named = [world.world_id for world in found if world.name == identity]
    known = {world.world_id: world for world in found}
    whole = named[0] if len(named) == 1 else identity
    picked = pick_id(whole, list(known), expected=f"the id of one of the {len(known)} worlds there")
    return place_of_world(known[picked])


def _listed_environment(identity: str, directory: Path) -> "NavigationEnvironment":
    from storage.environment_files import read_environments

    with misuse("--environments"):
        found = read_environments(directory).environments
    known = {environment.environment_id: environment for environment in found}
    return known[
        pick_id(identity, list(known), expected=f"the id of one of the {len(known)} environments")
    ]


def _export_stored(
    command: CommandContext,
    identity: str,
    path: Path,
    export_format: ExportFormat,
    *,
    course: bool,
) -> None:
    """Export what the store holds under an id."""
    layout = command.existing_store()
    table, row = find_row(layout, identity, expected="the id of a scenario or an environment")
    if table == "logs":
        raise typer.BadParameter(
            f"found {identity!r}, a log, expected a scenario or an environment (`ses scenarios` "
            "lists a log's scenarios)",
            param_hint="ID",
        )
    if table == "scenarios" and export_format == "mcap":
        if course:
            raise typer.BadParameter(
                "found a scenario's own drive (mcap), expected an environment or another format",
                param_hint="--course",
            )
        _write_scenario(command, layout, str(row["scenario_id"]), path)
        return
    environment_id = row["environment_id"]
    if environment_id is None:
        raise typer.BadParameter(
            f"found scenario {row['scenario_id']}, of whose place neither scans nor a map show "
            "anything, expected one with an environment (or --format mcap for its drive)",
            param_hint="ID",
        )
    environment = _stored_environment(layout, str(environment_id))
    _write_place(path, _place(environment, course=course), export_format)


def _stored_environment(layout: "Layout", environment_id: str) -> "NavigationEnvironment":
    from storage.scenario_tables import environments_of
    from storage.table_reader import open_table

    rows = open_table(layout.root, "environments")
    return environments_of(rows[rows["environment_id"] == environment_id].head(1))[0]


def _place(environment: "NavigationEnvironment", *, course: bool) -> "Place":
    from ses_core.place import course_of_environment, place_of_environment

    return course_of_environment(environment) if course else place_of_environment(environment)


def _write_place(path: Path, place: "Place", export_format: ExportFormat) -> None:
    if export_format == "mcap":
        from storage.scenario_mcap import write_place_mcap

        write_place_mcap(path, place)
        return
    from storage.place_files import write_place

    write_place(path, place, format=export_format)


def _write_scenario(
    command: CommandContext, layout: "Layout", scenario_id: str, path: Path
) -> None:
    from datetime import UTC, datetime

    from storage.scenario_mcap import write_scenario_mcap
    from storage.shown_logs import read_shown_log
    from storage.table_reader import open_table

    settings = command.settings()
    rows = open_table(
        layout.root, "scenarios", columns=["scenario_id", "log_id", "batch_date"]
    ).set_index("scenario_id")
    log_id, batch_date = rows.loc[scenario_id]
    log = read_shown_log(layout, str(log_id), settings=settings)
    extracted, trajectory = log.scenario(scenario_id)
    day = datetime.fromisoformat(str(batch_date)).replace(tzinfo=UTC)
    write_scenario_mcap(
        path,
        extracted,
        trajectory,
        scan_margin=settings.extraction.scan_margin_s,
        clock_start_ns=round(day.timestamp()) * 10**9,
    )
