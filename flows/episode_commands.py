"""`ses show episode`: what happened in a trial, driven again and drawn."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flows.command_arguments import existing_directory, misuse
from flows.command_context import CommandContext, answer_facts, command_context, given
from flows.episode_choice import chosen_trial, recorded_episode, recorded_trial
from flows.policy_names import check_policies
from flows.shared_options import (
    PartOption,
    ResolutionOption,
    SeedOption,
    SimulatorOption,
    WorldsOption,
)
from ses_core.errors import SesError
from ses_core.recipes import JsonValue

if TYPE_CHECKING:
    from ses_core.evaluation.episode_trace import EpisodeTrace
    from ses_core.evaluation.episodes import Episode
    from ses_core.evaluation.trials import Trial
    from ses_core.navigation import World
    from ses_core.settings import Settings

# A command line of its own, which `ses show` hands over to: it has to be told the same as that one.
app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)

POLICY = "dwa-slow"
"""Who drives unless somebody else is asked for: the paper's baseline."""

WorldOption = Annotated[
    str | None, typer.Option(metavar="NAME", help="Name or id of the world; else the first one.")
]
EvaluationOption = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="What `ses evaluate` wrote, in which EPISODE_ID is looked up.",
        callback=lambda path: path and existing_directory(path, "--evaluation"),
    ),
]


@app.command(
    epilog="Example: ses show episode --worlds barn --policy original --trial 2 --out trial.png"
)
def episode(
    context: typer.Context,
    worlds: WorldsOption,
    identity: Annotated[
        str | None,
        typer.Argument(metavar="EPISODE_ID", help="Of an evaluation; else options say which."),
    ] = None,
    evaluation: EvaluationOption = None,
    part: PartOption = None,
    resolution: ResolutionOption = None,
    world: WorldOption = None,
    policy: Annotated[
        str | None, typer.Option(metavar="NAME", help="Who drives; else dwa-slow.")
    ] = None,
    pair: Annotated[
        int | None, typer.Option(min=0, metavar="P", help="Pair of the world; else 0.")
    ] = None,
    trial: Annotated[
        int | None, typer.Option(min=0, metavar="T", help="Trial of the pair; else 0.")
    ] = None,
    seed: SeedOption = None,
    min_distance: Annotated[
        float | None, typer.Option(metavar="D", help="Least start-goal distance [m].")
    ] = None,
    simulator: SimulatorOption = None,
    at: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="Moment to look at; else where it struggled most."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Draw it there; else <EPISODE_ID>.png.")
    ] = None,
) -> None:
    """Draw an evaluation's trial: the way driven, what the robot saw, commands and parameters.

    The trial is driven again: under the options and settings of `ses evaluate` it is the very one
    in its table.
    """
    command = command_context(context)
    choices: dict[str, JsonValue] = {
        "--world": world,
        "--policy": policy,
        "--pair": pair,
        "--trial": trial,
        "--seed": seed,
        "--min-distance": min_distance,
        "--simulator": simulator,
    }
    recorded = recorded_episode(identity, evaluation, described=given(choices))
    overrides = {
        "evaluation.seed": seed,
        "evaluation.min_distance_m": min_distance,
        "evaluation.simulator": recorded.simulator if recorded else simulator,
    }
    settings = command.settings(given(overrides))
    name = recorded.policy if recorded else policy or POLICY
    check_policies(command, [name], "--evaluation" if recorded else "--policy")
    with misuse("--worlds"):
        known = _read_worlds(worlds, part, resolution)
    if recorded:
        trace = _drive(command, recorded_trial(known, settings, recorded), name, settings)
        _check_same(trace, recorded)
    else:
        chosen = chosen_trial(known, settings, world=world, pair=pair or 0, trial=trial or 0)
        trace = _drive(command, chosen, name, settings)
    _answer(command, trace, at=at, out=out)


def _read_worlds(paths: list[Path], part: str | None, resolution: float | None) -> "list[World]":
    from storage.world_sets import read_worlds

    return read_worlds(paths, part=part, resolution=resolution)


def _drive(
    command: CommandContext, trial: "Trial", policy: str, settings: "Settings"
) -> "EpisodeTrace":
    from ses_core.evaluation.episode_trace import Drive, record_episode
    from storage.layout import Layout
    from storage.policy_files import find_policy

    drive = Drive(
        trial=trial,
        name=policy,
        policy=find_policy(policy, Layout(command.root)).policy,
        simulation=settings.simulation,
        profile=settings.target_robot,
        simulator=settings.evaluation.simulator,
    )
    return record_episode(drive)


def _check_same(trace: "EpisodeTrace", recorded: "Episode") -> None:
    """Make sure that the episode driven again is the one that was recorded.

    Raises:
        SesError: It went another way.
    """
    again = trace.episode
    if again != recorded:
        raise SesError(
            f"episode {recorded.episode_id} ended {recorded.outcome} after {recorded.time_s:.2f} s "
            f"and {recorded.path_length_m:.2f} m, driven again {again.outcome} after "
            f"{again.time_s:.2f} s and {again.path_length_m:.2f} m: expected the worlds, policy "
            "and settings of its evaluation"
        )


def _answer(
    command: CommandContext, trace: "EpisodeTrace", *, at: float | None, out: Path | None
) -> None:
    """Draw the episode and tell its facts."""
    from ses_core.evaluation.episode_trace import look_at, telling_time
    from ses_core.pictures.episode_figure import episode_figure
    from storage.durable_files import replace_file

    with misuse("--at"):
        moment = look_at(trace, telling_time(trace) if at is None else at)
    target = (out or Path(f"{trace.episode.episode_id}.png")).absolute()
    target.parent.mkdir(parents=True, exist_ok=True)
    replace_file(target, episode_figure(trace, moment))
    facts: dict[str, JsonValue] = {
        **asdict(trace.episode),
        "reversing_s": trace.reversing_s,
        "standing_s": trace.standing_s,
        "at_s": moment.time,
        "picture": str(target),
    }
    answer_facts(command, facts)
