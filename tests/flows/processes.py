"""What is running: for tests that nothing is left behind."""

import os
import time
from pathlib import Path


def descendants(process: int) -> set[int]:
    """Give the numbers of all processes below one."""
    parents = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                text = (entry / "stat").read_text()
            except OSError:
                continue
            parents[int(entry.name)] = int(text.rpartition(")")[2].split()[1])
    found: set[int] = set()
    frontier = {process}
    while frontier:
        frontier = {child for child, parent in parents.items() if parent in frontier} - found
        found |= frontier
    return found


def wait_until_gone(processes: set[int], *, limit_s: float) -> set[int]:
    """Wait for processes to end; give those that did not within the limit."""
    deadline = time.monotonic() + limit_s
    left = set(processes)
    while left and time.monotonic() < deadline:
        left = {process for process in left if _is_running(process)}
        time.sleep(0.05)
    return left


def _is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, IndexError):
        return False
    # A zombie has ended; in a container without an init process nobody may be there to see it off.
    return state != "Z"
