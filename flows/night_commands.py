"""`ses nightly` and its first stages alone; `ses demo`."""

from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

import typer

from flows.command_arguments import existing_path, misuse
from flows.command_context import CommandContext, command_context, given
from flows.night_text import describe_night
from flows.prefect_server import embedded_server
from flows.shared_options import (
    CountKindOption,
    EnvironmentsOption,
    InboxOption,
    PartOption,
    ResolutionOption,
    ShareOption,
    SimulatorOption,
    SynthesizerName,
)
from ses_core.recipes import JsonValue

app = typer.Typer()

StageName = Literal[
    "ingest", "extract", "filter", "synthesize", "render", "train", "evaluate", "report"
]
DateOption = Annotated[
    datetime | None,
    typer.Option(formats=["%Y-%m-%d"], metavar="YYYY-MM-DD", help="Day of the batch; else today."),
]
RefreshOption = Annotated[
    StageName | None, typer.Option(help="Build this stage and all after it anew.")
]
HeldoutOption = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="PATH",
        help="Worlds to measure policies on, never trained in; else whole sites. May be repeated.",
        callback=lambda paths: (
            paths and [existing_path(path, "--heldout-worlds") for path in paths]
        ),
    ),
]
SynthesizerOption = Annotated[
    SynthesizerName | None, typer.Option(help="How environments are made.")
]
ThresholdOption = Annotated[
    float | None, typer.Option(metavar="N", help="Challenging is a count strictly above this.")
]
TrainStepsOption = Annotated[
    int | None, typer.Option("--train-steps", metavar="N", help="Decisions to train.")
]
DeadlineOption = Annotated[
    float | None,
    typer.Option(metavar="HOURS", help="From then on training stops and what is there is judged."),
]


@app.command(epilog="Example: ses nightly --inbox logs --challenging-share 0.23")
def nightly(
    context: typer.Context,
    inbox: InboxOption,
    date: DateOption = None,
    synthesizer: SynthesizerOption = None,
    environments: EnvironmentsOption = None,
    train_steps: TrainStepsOption = None,
    count_kind: CountKindOption = None,
    threshold: ThresholdOption = None,
    challenging_share: ShareOption = None,
    heldout_worlds: HeldoutOption = None,
    part: PartOption = None,
    resolution: ResolutionOption = None,
    simulator: SimulatorOption = None,
    deadline: DeadlineOption = None,
    refresh: RefreshOption = None,
) -> None:
    """Go from new logs to a judged policy and a report; without new logs, build nothing."""
    command = command_context(context)
    overrides = given(
        {
            "synthesis.environments": environments,
            "training.steps": train_steps,
            "training.simulator": simulator,
            "evaluation.simulator": simulator,
        }
    )
    overrides |= challenging(count_kind, threshold, challenging_share)
    overrides |= synthesizer_override(command, synthesizer)
    settings = command.settings(overrides)
    if deadline is not None and deadline <= 0:
        raise typer.BadParameter(f"found {deadline}, expected hours > 0", param_hint="--deadline")
    worlds = tuple(heldout_worlds or ())
    if worlds:
        from storage.world_sets import read_worlds

        with misuse("--heldout-worlds"):
            read_worlds(worlds, part=part, resolution=resolution)
    with embedded_server(command.root):
        from flows.nightly_batch import nightly as nightly_flow

        summary = nightly_flow(
            inbox=inbox,
            root=command.root,
            date=date.date() if date else None,
            settings=settings,
            heldout_worlds=worlds,
            heldout_part=part,
            heldout_resolution=resolution,
            refresh=refresh,
            deadline_hours=deadline,
        )
    command.answer(summary.model_dump(mode="json"), lambda: describe_night(summary))


@app.command(epilog="Example: ses demo --root demo-store")
def demo(context: typer.Context) -> None:
    """Let a small simulated fleet drive through homes, then run the night over its logs."""
    command = command_context(context)
    settings = None if command.settings_file is None else command.settings()
    with embedded_server(command.root):
        from flows.demonstration import demonstrate

        summary = demonstrate(command.root, settings)
    remark = (
        f"\nThis is a demonstration, not evidence: {summary.decisions_trained:,} decisions trained."
    )
    command.answer(summary.model_dump(mode="json"), lambda: describe_night(summary) + remark)


@app.command(epilog="Example: ses ingest --inbox logs")
def ingest(
    context: typer.Context,
    inbox: InboxOption,
    date: DateOption = None,
    refresh: RefreshOption = None,
) -> None:
    """Take new logs in: decode, resample, keep; refuse what cannot be used, with its reason."""
    command = command_context(context)
    settings = command.settings()
    with embedded_server(command.root):
        from flows.nightly_batch import ingest_only

        summary = ingest_only(
            inbox=inbox,
            root=command.root,
            date=date.date() if date else None,
            settings=settings,
            refresh=refresh,
        )
    command.answer(summary.model_dump(mode="json"), lambda: describe_night(summary))


@app.command(epilog="Example: ses extract --challenging-share 0.23")
def extract(
    context: typer.Context,
    count_kind: CountKindOption = None,
    threshold: ThresholdOption = None,
    challenging_share: ShareOption = None,
    refresh: RefreshOption = None,
) -> None:
    """Cut the logs that were taken in into scenarios and rebuild each one's place."""
    command = command_context(context)
    settings = command.settings(challenging(count_kind, threshold, challenging_share))
    with embedded_server(command.root):
        from flows.nightly_batch import extract_only

        summary = extract_only(root=command.root, settings=settings, refresh=refresh)
    command.answer(summary.model_dump(mode="json"), lambda: describe_night(summary))


def challenging(
    count_kind: str | None, threshold: float | None, share: float | None
) -> dict[str, JsonValue]:
    """Give the settings that say what is challenging.

    Raises:
        typer.BadParameter: Threshold and share were both given.
    """
    if threshold is not None and share is not None:
        raise typer.BadParameter(
            "found both --threshold and --challenging-share, expected one of them",
            param_hint="--threshold",
        )
    options = given(
        {
            "filter.count_kind": count_kind,
            "filter.threshold": threshold,
            "filter.challenging_share": share,
        }
    )
    if threshold is not None:
        # The settings file may ask for a share; the command line has the last word.
        options["filter.challenging_share"] = None
    return options


def synthesizer_override(command: CommandContext, method: str | None) -> dict[str, JsonValue]:
    """Give the setting for a synthesizer by name; of the one in the file, keep its numbers."""
    if method is None or command.settings().synthesis.synthesizer.method == method:
        return {}
    return {"synthesis.synthesizer": {"method": method}}
