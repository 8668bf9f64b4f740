"""`ses bench`: side-by-side benchmarks, both sides in one run."""

import runpy
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from flows.command_context import command_context

app = typer.Typer()

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


@app.command(epilog="Example: ses bench increment")
def bench(
    context: typer.Context,
    name: Annotated[str, typer.Argument(metavar="NAME", help="Which one, e.g. increment.")],
) -> None:
    """Measure one of the project's promises: what we need, what the other side needs, the ratio."""
    from flows.prefect_server import embedded_server

    command = command_context(context)
    known = sorted(file.stem for file in BENCHMARKS.glob("[a-z]*.py"))
    if name not in known:
        raise typer.BadParameter(
            f"found {name!r}, expected one of {', '.join(known)}", param_hint="NAME"
        )
    with tempfile.TemporaryDirectory(prefix="ses-bench-") as scratch:
        folder = Path(scratch)
        with embedded_server(folder):
            # Benchmarks are no package: they come with the checkout, not with the installation.
            # Their helpers lie beside them, as if each was run as a script.
            sys.path.insert(0, str(BENCHMARKS))
            rows = runpy.run_path(str(BENCHMARKS / f"{name}.py"))["measure"](folder)
    command.answer_rows(rows, empty="nothing was measured")
