"""The `ses` command: global options, and what each ending means to the shell."""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, NoReturn

import typer
from typer._click.exceptions import UsageError

from flows import (
    bench_commands,
    export_commands,
    log_commands,
    night_commands,
    policy_commands,
    quarantine_commands,
    scorecard_commands,
    serve_commands,
    show_commands,
    store_commands,
    training_commands,
    world_commands,
)
from flows.command_arguments import describe_misuse, hoist_global_options, sentence
from flows.command_context import CommandContext, answers_only_on_stdout
from flows.prompt_ending import end_soon_after_signals
from ses_core.errors import SesError, SettingsError

FAILED, MISUSED = 1, 2

app = typer.Typer(
    name="ses",
    help="From a fleet's own logs to a judged navigation policy, every night.",
    epilog="Example: ses nightly --inbox logs",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for group in (
    night_commands,
    log_commands,
    show_commands,
    export_commands,
    quarantine_commands,
    world_commands,
    training_commands,
    scorecard_commands,
    policy_commands,
    store_commands,
    serve_commands,
    bench_commands,
):
    app.add_typer(group.app)


@app.callback()
def global_options(
    context: typer.Context,
    root: Annotated[Path, typer.Option(envvar="SES_ROOT", help="Folder of the store.")] = Path(
        "ses-data"
    ),
    settings: Annotated[
        Path | None, typer.Option(metavar="FILE.toml", help="Settings; else the paper's.")
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="One JSON value on stdout, logs on stderr.")
    ] = False,
) -> None:
    """Take the options that every command has."""
    output = context.with_resource(answers_only_on_stdout(is_json=json))
    context.obj = CommandContext(
        root=root.absolute(), settings_file=settings, is_json=json, output=output
    )


def run(arguments: Sequence[str]) -> int:
    """Run a command line.

    Returns:
        0 done, 1 failed, 2 misused, 3 refused by the gate, 130 interrupted.
    """
    try:
        status = app(hoist_global_options(arguments), prog_name="ses", standalone_mode=False)
    except UsageError as error:
        return _complain(describe_misuse(error), MISUSED)
    except SettingsError as error:
        return _complain(f"ses: {sentence(error)}", MISUSED)
    except SesError as error:
        return _complain(f"ses: {sentence(error)}", FAILED)
    return status if isinstance(status, int) else 0


def main() -> NoReturn:
    """Run the command line that this process was started with."""
    # Our own threads use the cores; the linear algebra libraries must not fight them for it.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    end_soon_after_signals()
    sys.exit(run(sys.argv[1:]))


def _complain(line: str, status: int) -> int:
    sys.stderr.write(line + "\n")
    return status


if __name__ == "__main__":
    main()
