"""Children that never outlive us: `python -m flows.child_process MODULE ARGUMENTS...`."""

import ctypes
import os
import runpy
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

PARENT_VARIABLE = "SES_PARENT_PROCESS"
_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def child_command(module: str, *arguments: str) -> list[str]:
    """Give the command line that runs a module as a child which ends with its parent."""
    return [sys.executable, "-m", "flows.child_process", module, *arguments]


def start_child(
    module: str,
    arguments: Sequence[str],
    *,
    environment: Mapping[str, str],
    log: Path,
    pass_fds: Sequence[int] = (),
) -> subprocess.Popen[bytes]:
    """Start a module as a child; what it says goes to a log file.

    The child gets a session of its own, so that Ctrl-C reaches us alone and we end it in order.
    """
    with log.open("ab") as output:
        return subprocess.Popen(
            child_command(module, *arguments),
            env={**environment, PARENT_VARIABLE: str(os.getpid())},
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            pass_fds=tuple(pass_fds),
            start_new_session=True,
        )


def stop_child(child: subprocess.Popen[bytes], *, patience_s: float) -> None:
    """Ask a child to end, then end it."""
    if child.poll() is None:
        child.terminate()
        try:
            child.wait(timeout=patience_s)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()


def die_with_parent() -> None:
    """Have the kernel end this process when its parent ends, however the parent ends.

    Elsewhere than on Linux there is no such service: there only an orderly end reaches children.
    """
    if sys.platform != "linux":
        return
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    expected = os.environ.get(PARENT_VARIABLE)
    if expected is not None and os.getppid() != int(expected):
        sys.exit(f"parent process {expected} ended before its child started")


def main() -> None:
    """Run the module named on the command line, tied to the parent's life."""
    die_with_parent()
    # A grandchild has another parent: an inherited number would end it at its start.
    os.environ.pop(PARENT_VARIABLE, None)
    # Started in the background of a script we inherit SIGINT as ignored, and Prefect's worker
    # turns SIGTERM into SIGINT: it would never end.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    module, *arguments = sys.argv[1:]
    sys.argv = [module, *arguments]
    runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
