"""`ses worlds generate`, and `ses deploy`: a simulated fleet's day in them."""

from typing import Annotated, Literal

import typer

from flows.command_context import answer_facts, command_context, given
from flows.fleet_options import (
    DateOption,
    DeploymentsOption,
    DriverOption,
    DrivesPerLogOption,
    LogFormatOption,
    MinDistanceOption,
    OdometryDriftOption,
    PublishMapOption,
    RobotsOption,
    SplitSecondsOption,
)
from flows.policy_names import check_policies
from flows.shared_options import (
    OutOption,
    PairPresetOption,
    PartOption,
    ResolutionOption,
    SeedOption,
    SimulatorOption,
    WorldsOption,
)
from flows.world_set_commands import answer_worlds, worlds_app

app = typer.Typer()
app.add_typer(worlds_app)


@worlds_app.command(epilog="Example: ses worlds generate homes --count 8 --seed 3 --out homes")
def generate(
    context: typer.Context,
    kind: Annotated[Literal["barn", "homes"], typer.Argument(help="Generator.")],
    count: Annotated[int, typer.Option(metavar="N", min=1, help="Worlds to make.")],
    out: OutOption,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="World i of a seed is fixed.")] = 0,
) -> None:
    """Generate a world set: BARN's cellular automaton, or furnished homes."""
    from storage.world_sets import write_world_set

    if kind == "barn":
        from ses_core.worlds.cellular_automata import generate_barn

        worlds = [generated.world for generated in generate_barn(count, seed=seed)]
    else:
        from ses_core.worlds.homes import generate_homes

        worlds = generate_homes(count, seed=seed)
    write_world_set(out, worlds)
    answer_worlds(command_context(context), worlds)


@app.command(
    epilog="Example: ses deploy --worlds homes --policy dwa-slow --deployments 40 --out inbox"
)
def deploy(
    context: typer.Context,
    worlds: WorldsOption,
    deployments: DeploymentsOption,
    out: OutOption,
    policy: DriverOption = "dwa-slow",
    log_format: LogFormatOption = "mcap",
    part: PartOption = None,
    resolution: ResolutionOption = None,
    min_distance: MinDistanceOption = None,
    pair_preset: PairPresetOption = None,
    robots: RobotsOption = None,
    drives_per_log: DrivesPerLogOption = None,
    split_seconds: SplitSecondsOption = None,
    publish_map: PublishMapOption = False,
    odometry_drift: OdometryDriftOption = None,
    date: DateOption = None,
    simulator: SimulatorOption = None,
    seed: SeedOption = None,
) -> None:
    """Let a simulated fleet drive for a day and write its logs as <site>/<robot>/."""
    from flows.prefect_server import embedded_server
    from ses_core.imperfections import resolve

    command = command_context(context)
    if split_seconds is not None and log_format not in ("mcap", "db3"):
        raise typer.BadParameter(
            f"found format {log_format}, expected mcap or db3", param_hint="--split-seconds"
        )
    options = given(
        {
            "evaluation.simulator": simulator,
            "evaluation.min_distance_m": min_distance,
            "evaluation.pair_preset": pair_preset,
            "fleet.robots_per_site": robots,
            "fleet.drives_per_log": drives_per_log,
            "fleet.split_s": split_seconds,
            "fleet.publishes_map": publish_map or None,
        }
    )
    if odometry_drift is not None:
        levels = resolve(command.settings({}).simulation.imperfections).model_dump()
        options["simulation.imperfections"] = {**levels, "odometry_drift": odometry_drift}
    settings = command.settings(options)
    check_policies(command, [policy], "--policy")
    with embedded_server(command.root):
        from flows.fleet_deployment import deploy as deploy_flow

        summary = deploy_flow(
            root=command.root,
            worlds=tuple(worlds),
            part=part,
            resolution=resolution,
            policy=policy,
            deployments=deployments,
            out=out.absolute(),
            format=log_format,
            seed=seed or 0,
            date=date.date() if date else None,
            settings=settings,
        )
    answer_facts(command, summary.model_dump(mode="json"))
