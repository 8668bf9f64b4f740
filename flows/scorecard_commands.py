"""`ses scorecard`: how well synthesized environments stand for recorded ones."""

from pathlib import Path
from typing import Annotated

import typer

from flows.command_arguments import existing_directory, misuse
from flows.command_context import Row, aligned, command_context, given
from flows.policy_names import check_policies
from flows.prefect_server import embedded_server
from flows.shared_options import SeedOption
from ses_core.recipes import JsonValue

app = typer.Typer()


@app.command(epilog="Example: ses scorecard --real recorded --synthesized environments")
def scorecard(
    context: typer.Context,
    real: Annotated[
        Path,
        typer.Option(
            metavar="DIR",
            help="Folder of real environments.parquet; a scenarios.parquet there tells sites.",
            callback=lambda path: path and existing_directory(path, "--real"),
        ),
    ],
    synthesized: Annotated[
        Path,
        typer.Option(
            metavar="DIR",
            help="Folder of environments that `ses synthesize` wrote.",
            callback=lambda path: path and existing_directory(path, "--synthesized"),
        ),
    ],
    training: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder of those learned from, if the real ones were held out.",
            callback=lambda path: path and existing_directory(path, "--training"),
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder for the table, a page and a picture: scorecard.parquet, .html, .png.",
        ),
    ] = None,
    policy: Annotated[
        str, typer.Option(metavar="NAME", help="Whose drives tell how hard a place is.")
    ] = "dwa-slow",
    driven: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Most environments driven through; twice as many real ones, to halve."
        ),
    ] = None,
    seed: SeedOption = None,
) -> None:
    """Score synthesized environments against real ones, each number beside its ceiling."""
    command = command_context(context)
    settings = command.settings(given({"scorecard.driven": driven, "scorecard.seed": seed}))
    check_policies(command, [policy], "--policy")
    from storage.environment_files import read_environments

    folders = {"--real": real, "--synthesized": synthesized, "--training": training}
    identities: dict[str, set[str]] = {}
    for option, folder in folders.items():
        if folder is None:
            continue
        with misuse(option):
            environments = read_environments(folder).environments
        identities[option] = {environment.environment_id for environment in environments}
    if shared := identities["--real"] & identities.get("--training", set()):
        raise typer.BadParameter(
            f"found {len(shared)} environments that are in --real too, expected held-out ones "
            "there; leave --training out where the real ones were learned from",
            param_hint="--training",
        )
    with embedded_server(command.root):
        from flows.environment_scorecard import scorecard as scorecard_flow
        from storage.scorecard_files import row_record

        found = scorecard_flow(
            root=command.root,
            real=real,
            synthesized=synthesized,
            policy=policy,
            training=training,
            out=out.absolute() if out else None,
            settings=settings,
        )
    rows = [row_record(row) for row in found]
    command.answer(rows, lambda: aligned([_shown(row) for row in rows]))


def _shown(row: Row) -> dict[str, JsonValue]:
    """Fit a row into a line: intervals as one column, the rest is in the table and the JSON."""
    return {
        "metric": row["metric"],
        "value": row["value"],
        "95 %": _interval(row["low"], row["high"]),
        "real": row["real_value"],
        "real 95 %": _interval(row["real_low"], row["real_high"]),
        "p": row["p_value"],
        "aim": row["aim"],
        "feature": row["feature"],
        "note": row["note"],
    }


def _interval(low: JsonValue, high: JsonValue) -> str:
    if not isinstance(low, float) or not isinstance(high, float):
        return "-"
    return f"{low:.3g} to {high:.3g}"
