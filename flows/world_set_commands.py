"""`ses worlds import` and `ses worlds show`: maps of every kind, as world sets and as pictures."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from flows.command_arguments import existing_path, misuse
from flows.command_context import CommandContext, aligned, command_context, given
from flows.shared_options import (
    OutOption,
    PairPresetOption,
    PartOption,
    ResolutionOption,
    SeedOption,
)
from ses_core.recipes import JsonValue

if TYPE_CHECKING:
    from ses_core.navigation import World
    from ses_core.settings import Settings
    from storage.world_sets import WorldsFound

worlds_app = typer.Typer(
    name="worlds",
    help="Make, import and look at sets of worlds.",
    epilog="Example: ses worlds generate barn --count 12 --out barn-worlds",
)

SHEET_WORLDS = 36
"""Worlds on a contact sheet when nothing else is asked for."""

MapPaths = Annotated[
    list[Path],
    typer.Argument(
        metavar="PATH...",
        help="Maps (yaml, images), .world files, HouseExpo json, BARN npy, logs with a map, "
        "meshes (glb, ply, obj, stl), world sets, folders or tar archives of these.",
        callback=lambda paths: [existing_path(path, "PATH") for path in paths],
    ),
]
SliceFromOption = Annotated[
    float,
    typer.Option(
        "--slice-from",
        metavar="H",
        help="Of meshes and .world files: what is lower above the floor is driven over [m].",
    ),
]
SliceToOption = Annotated[
    float,
    typer.Option("--slice-to", metavar="H", help="What is higher than this is driven under [m]."),
]
UpOption = Annotated[
    Literal["auto", "x", "y", "z"],
    typer.Option("--up", help="Axis of meshes that points up; auto: y in glb, z in the others."),
]
FloorOption = Annotated[
    float | None,
    typer.Option(
        "--floor", metavar="H", help="Height of a mesh's floor [m]; else its lowest large one."
    ),
]
BarnCourseOption = Annotated[
    Literal["protocol", "path"],
    typer.Option(
        "--barn-course",
        help="Start and goal of BARN worlds: the benchmark's, or by their path_N.npy.",
    ),
]


@worlds_app.command(
    "import", epilog="Example: ses worlds import maps --resolution 0.05 --out fleet-maps"
)
def import_worlds(
    context: typer.Context,
    paths: MapPaths,
    out: OutOption,
    resolution: ResolutionOption = None,
    part: PartOption = None,
    slice_from: SliceFromOption = 0.1,
    slice_to: SliceToOption = 0.5,
    up: UpOption = "auto",
    floor: FloorOption = None,
    barn_course: BarnCourseOption = "protocol",
) -> None:
    """Read maps of any kind and write them as one world set."""
    from storage.world_sets import write_world_set

    found = _find(
        paths,
        part=part,
        resolution=resolution,
        slice_from=slice_from,
        slice_to=slice_to,
        up=up,
        floor=floor,
        barn_course=barn_course,
    )
    write_world_set(out, found.worlds)
    _answer_found(command_context(context), found)


@worlds_app.command(epilog="Example: ses worlds show barn-worlds --out barn.png")
def show(
    context: typer.Context,
    paths: MapPaths,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Draw a contact sheet there.")
    ] = None,
    resolution: ResolutionOption = None,
    part: PartOption = None,
    count: Annotated[
        int, typer.Option(metavar="N", min=1, help="Worlds on the sheet at most.")
    ] = SHEET_WORLDS,
    pairs: Annotated[
        int, typer.Option(metavar="P", min=0, help="Start-goal pairs drawn into each world.")
    ] = 2,
    min_distance: Annotated[
        float | None, typer.Option(metavar="D", help="Least start-goal distance [m].")
    ] = None,
    pair_preset: PairPresetOption = None,
    seed: SeedOption = None,
    slice_from: SliceFromOption = 0.1,
    slice_to: SliceToOption = 0.5,
    up: UpOption = "auto",
    floor: FloorOption = None,
    barn_course: BarnCourseOption = "protocol",
) -> None:
    """List worlds, and draw them with start-goal pairs as an evaluation would draw them."""
    command = command_context(context)
    settings = command.settings(
        given(
            {
                "evaluation.min_distance_m": min_distance,
                "evaluation.pair_preset": pair_preset,
                "evaluation.seed": seed,
            }
        )
    )
    found = _find(
        paths,
        part=part,
        resolution=resolution,
        slice_from=slice_from,
        slice_to=slice_to,
        up=up,
        floor=floor,
        barn_course=barn_course,
    )
    if out is not None:
        _draw(out.absolute(), found.worlds, count=count, pairs=pairs, settings=settings)
    _answer_found(command, found)


def answer_worlds(command: CommandContext, worlds: "Sequence[World]") -> None:
    """Answer with a row for each world."""
    rows = _rows(worlds)
    command.answer({"worlds": rows, "passed_over": 0}, lambda: aligned(rows))


def _find(
    paths: Sequence[Path],
    *,
    part: str | None,
    resolution: float | None,
    slice_from: float,
    slice_to: float,
    up: Literal["auto", "x", "y", "z"],
    floor: float | None,
    barn_course: Literal["protocol", "path"],
) -> "WorldsFound":
    from ses_core.worlds.mesh_slicing import MeshSlicing
    from storage.world_sets import find_worlds
    from storage.world_sources import Reading

    with misuse("--slice-from"):
        slicing = MeshSlicing(low=slice_from, high=slice_to, up=up, floor=floor)
    with misuse("--resolution"):
        reading = Reading(resolution=resolution, slicing=slicing, barn_course=barn_course)
    with misuse("PATH"):
        return find_worlds(paths, part=part, reading=reading)


def _draw(
    out: Path, worlds: "Sequence[World]", *, count: int, pairs: int, settings: "Settings"
) -> None:
    from ses_core.evaluation.places import pairs_of
    from ses_core.pictures.world_figure import world_sheet
    from storage.durable_files import replace_file

    evaluation = settings.evaluation.model_copy(update={"pairs": pairs})
    tasks = {
        world.world_id: pairs_of(world, settings=evaluation, profile=settings.target_robot)
        for world in worlds[:count]
        if pairs
    }
    out.parent.mkdir(parents=True, exist_ok=True)
    replace_file(out, world_sheet(worlds, tasks=tasks, limit=count))


def _answer_found(command: CommandContext, found: "WorldsFound") -> None:
    """Answer with a row for each world; what was refused is said on stderr, a line each."""
    for line in found.refused:
        sys.stderr.write(f"refused: {line}\n")
    rows = _rows(found.worlds)
    notes = [
        f"\n{count} files {said}"
        for count, said in (
            (len(found.passed_over), "that are no maps were passed over"),
            (len(found.refused), "were refused"),
        )
        if count
    ]
    answer: dict[str, JsonValue] = {
        "worlds": rows,
        "passed_over": len(found.passed_over),
        "refused": list(found.refused),
    }
    command.answer(answer, lambda: aligned(rows) + "".join(notes))


def _rows(worlds: "Sequence[World]") -> list[dict[str, JsonValue]]:
    return [
        {
            "world_id": world.world_id,
            "name": world.name,
            "width_m": round(world.grid.width_m, 3),
            "height_m": round(world.grid.height_m, 3),
            "resolution_m": world.grid.resolution,
            "free_fraction": round(float((~world.grid.cells).mean()), 4),
        }
        for world in worlds
    ]
