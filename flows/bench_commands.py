"""`ses bench`: side-by-side benchmarks."""

import typer

app = typer.Typer()
