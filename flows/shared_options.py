"""Options that several commands have, declared once."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from flows.command_arguments import existing_directory, existing_path

SimulatorName = Literal["batch", "bullet"]
SynthesizerName = Literal[
    "gan",
    "gan-paper",
    "pca",
    "pca-paper",
    "rs",
    "medoids",
    "identity",
    "mirror",
    "autoregressive",
]
CountKind = Literal["negative", "not-forward", "reversing-seconds"]

InboxOption = Annotated[
    Path,
    typer.Option(
        "--inbox",
        metavar="DIR",
        help="Folder of robot logs, best as <site>/<robot>/.",
        callback=lambda path: path and existing_directory(path, "--inbox"),
    ),
]
WorldsOption = Annotated[
    list[Path],
    typer.Option(
        "--worlds",
        metavar="PATH",
        help="World set, map, BARN .world file, or a folder of these; may be repeated.",
        callback=lambda paths: paths and [existing_path(path, "--worlds") for path in paths],
    ),
]
PartOption = Annotated[
    str | None,
    typer.Option("--part", metavar="NAME", help="Only this part of the folder's split.csv."),
]
ResolutionOption = Annotated[
    float | None,
    typer.Option("--resolution", metavar="R", help="Of images that carry none [m per pixel]."),
]
PairPresetOption = Annotated[
    Literal["default", "long"] | None,
    typer.Option(
        "--pair-preset",
        help="Pairs: anywhere far enough apart, or long ones for several scenarios a drive.",
    ),
]
SimulatorOption = Annotated[
    SimulatorName | None,
    typer.Option("--simulator", help="Compiled and kinematic, or PyBullet's rigid bodies."),
]
SeedOption = Annotated[
    int | None, typer.Option("--seed", metavar="S", min=0, help="Of everything drawn at random.")
]
OutOption = Annotated[
    Path, typer.Option("--out", metavar="DIR", help="Folder to write to; made if need be.")
]
CountKindOption = Annotated[
    CountKind | None, typer.Option("--count-kind", help="What is counted in a scenario.")
]
ShareOption = Annotated[
    float | None,
    typer.Option(
        "--challenging-share",
        metavar="S",
        help="Instead of a threshold: this share, hardest first.",
    ),
]
EnvironmentsOption = Annotated[
    int | None, typer.Option("--environments", metavar="M", help="Environments to synthesize.")
]
StepsOption = Annotated[
    int | None, typer.Option("--steps", metavar="N", help="Decisions to train.")
]
