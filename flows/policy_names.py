"""Names of policies on the command line, looked at before anything starts."""

from collections.abc import Sequence

from flows.command_arguments import misuse
from flows.command_context import CommandContext


def check_policies(command: CommandContext, names: Sequence[str], option: str) -> None:
    """Make sure that every name is a policy's.

    Raises:
        typer.BadParameter: There is no name, or nothing has that name.
    """
    from storage.layout import Layout
    from storage.policy_files import find_policy

    layout = Layout(command.root)
    with misuse(option):
        if not names:
            raise ValueError("found no name, expected policies separated by commas")
        for name in names:
            find_policy(name, layout)
