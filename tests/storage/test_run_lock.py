import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from storage.layout import open_layout
from storage.run_lock import StoreBusyError, lock_holder, run_lock

HOLD = """
import sys, time
from pathlib import Path
from storage.layout import open_layout
from storage.run_lock import run_lock
with run_lock(open_layout(Path(sys.argv[1])), purpose="the night of 2026-11-22"):
    print("held", flush=True)
    time.sleep(600)
"""


def test_a_second_night_is_told_at_once_who_holds_the_store(tmp_path: Path) -> None:
    layout = open_layout(tmp_path)
    with run_lock(layout, purpose="a night"):
        with (
            pytest.raises(StoreBusyError, match=rf"in use by a night \(process {os.getpid()} on"),
            run_lock(layout, purpose="another"),
        ):
            pass
        assert "a night" in str(lock_holder(layout))
    assert lock_holder(layout) is None
    with run_lock(layout, purpose="another"):
        pass


def test_the_lock_of_a_killed_night_is_free(tmp_path: Path) -> None:
    layout = open_layout(tmp_path)
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    root = Path(__file__).parents[2]
    with subprocess.Popen(command, cwd=root, stdout=subprocess.PIPE) as night:
        assert night.stdout is not None
        assert night.stdout.readline() == b"held\n"
        with (
            pytest.raises(StoreBusyError, match=rf"night of 2026-11-22 \(process {night.pid} on"),
            run_lock(layout, purpose="another"),
        ):
            pass
        night.send_signal(signal.SIGKILL)
        night.wait()
    with run_lock(layout, purpose="the next"):
        pass
