"""`ses synthesize`, `pretrain`, `train` and `evaluate`: the stages after the logs, by hand."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from flows.command_arguments import existing_path
from flows.command_context import aligned, answer_facts, command_context, given
from flows.night_commands import SynthesizerOption, challenging, synthesizer_override
from flows.policy_names import check_policies
from flows.prefect_server import embedded_server
from flows.shared_options import (
    CountKindOption,
    OutOption,
    PairPresetOption,
    PartOption,
    ResolutionOption,
    SeedOption,
    ShareOption,
    SimulatorOption,
    StepsOption,
    WorldsOption,
)

app = typer.Typer()

EnvironmentsFolder = Annotated[
    Path,
    typer.Option(
        "--environments",
        metavar="DIR",
        help="Folder of environments that `ses synthesize` wrote.",
        callback=lambda path: path and existing_path(path, "--environments"),
    ),
]


@app.command(epilog="Example: ses synthesize --method pca --count 100 --out environments")
def synthesize(
    context: typer.Context,
    out: OutOption,
    method: SynthesizerOption = None,
    count: Annotated[
        int | None, typer.Option(metavar="N", help="Environments to synthesize.")
    ] = None,
    source: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="DIR",
            help="Environments to learn from; else the store's challenging ones.",
            callback=lambda path: path and existing_path(path, "--from"),
        ),
    ] = None,
    count_kind: CountKindOption = None,
    challenging_share: ShareOption = None,
    seed: SeedOption = None,
) -> None:
    """Synthesize environments like the challenging ones."""
    command = command_context(context)
    overrides = given({"synthesis.environments": count, "synthesis.seed": seed})
    overrides |= challenging(count_kind, None, challenging_share)
    overrides |= synthesizer_override(command, method)
    settings = command.settings(overrides)
    with embedded_server(command.root):
        from flows.environment_synthesis import synthesize as synthesize_flow

        summary = synthesize_flow(
            root=command.root, out=out.absolute(), source=source, settings=settings
        )
    answer_facts(command, summary.model_dump(mode="json"))


@app.command(epilog="Example: ses pretrain --steps 300000 --out original")
def pretrain(
    context: typer.Context,
    out: OutOption,
    worlds: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="PATH",
            help="Worlds to train in; else those of the BARN generator.",
            callback=lambda paths: paths and [existing_path(path, "--worlds") for path in paths],
        ),
    ] = None,
    part: PartOption = None,
    resolution: ResolutionOption = None,
    steps: StepsOption = None,
    seed: SeedOption = None,
) -> None:
    """Train the original policy, which nights go on from until there is a champion."""
    command = command_context(context)
    settings = command.settings()
    with embedded_server(command.root):
        from flows.policy_training import pretrain as pretrain_flow

        summary = pretrain_flow(
            out=out.absolute(),
            steps=steps,
            seed=seed,
            worlds=tuple(worlds or ()),
            part=part,
            resolution=resolution,
            settings=settings,
        )
    answer_facts(command, summary.model_dump(mode="json"))


@app.command(epilog="Example: ses train --environments environments --steps 20000 --out policy")
def train(
    context: typer.Context,
    environments: EnvironmentsFolder,
    out: OutOption,
    parent: Annotated[
        str, typer.Option("--from", metavar="POLICY", help="Policy to go on from.")
    ] = "champion",
    steps: StepsOption = None,
    algorithm: Annotated[
        Literal["ppo", "td3", "sac"] | None, typer.Option(help="Of stable-baselines3.")
    ] = None,
    simulator: SimulatorOption = None,
    seed: SeedOption = None,
) -> None:
    """Fine-tune a policy in environments and write its bundle."""
    command = command_context(context)
    settings = command.settings(
        given(
            {
                "training.steps": steps,
                "training.algorithm": algorithm,
                "training.simulator": simulator,
                "training.seed": seed,
            }
        )
    )
    check_policies(command, [parent], "--from")
    with embedded_server(command.root):
        from flows.policy_training import train as train_flow

        summary = train_flow(
            root=command.root,
            environments=environments,
            out=out.absolute(),
            parent=parent,
            settings=settings,
        )
    answer_facts(command, summary.model_dump(mode="json"))


@app.command(
    epilog="Example: ses evaluate --worlds barn --policies champion,dwa-slow --out measured"
)
def evaluate(
    context: typer.Context,
    worlds: WorldsOption,
    policies: Annotated[
        str, typer.Option(metavar="A,B,...", help="Policies, first the one in question.")
    ],
    out: OutOption,
    part: PartOption = None,
    resolution: ResolutionOption = None,
    pairs: Annotated[
        int | None, typer.Option(metavar="P", help="Start-goal pairs per world.")
    ] = None,
    trials: Annotated[
        int | None, typer.Option(metavar="T", help="Trials per pair and policy.")
    ] = None,
    min_distance: Annotated[
        float | None, typer.Option(metavar="D", help="Least start-goal distance [m].")
    ] = None,
    pair_preset: PairPresetOption = None,
    simulator: SimulatorOption = None,
    seed: SeedOption = None,
) -> None:
    """Drive policies through the same worlds, pairs and seeds, and compare them."""
    command = command_context(context)
    settings = command.settings(
        given(
            {
                "evaluation.pairs": pairs,
                "evaluation.trials": trials,
                "evaluation.min_distance_m": min_distance,
                "evaluation.pair_preset": pair_preset,
                "evaluation.simulator": simulator,
                "evaluation.seed": seed,
            }
        )
    )
    names = [name.strip() for name in policies.split(",") if name.strip()]
    check_policies(command, names, "--policies")
    with embedded_server(command.root):
        from flows.policy_evaluation import evaluate as evaluate_flow

        summary = evaluate_flow(
            root=command.root,
            worlds=tuple(worlds),
            part=part,
            resolution=resolution,
            policies=tuple(names),
            out=out.absolute(),
            settings=settings,
        )
    found = summary.model_dump(mode="json")
    command.answer(found, lambda: "\n\n".join(aligned(rows) for rows in found.values() if rows))
