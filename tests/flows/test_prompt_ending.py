"""A command ends soon after a signal, whatever keeps it busy."""

import signal
import subprocess
import sys
import time

import pytest

BUSY = """
import signal, time
from flows.prompt_ending import end_soon_after_signals

end_soon_after_signals(0.2)
signal.signal(signal.SIGTERM, lambda *_: None)
print("busy", flush=True)
while True:
    try:
        time.sleep(60)
    except KeyboardInterrupt:
        continue
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_busy_command_ends_soon_after_a_signal(number: signal.Signals) -> None:
    with subprocess.Popen([sys.executable, "-c", BUSY], stdout=subprocess.PIPE) as command:
        assert command.stdout is not None
        assert command.stdout.readline() == b"busy\n"
        time.sleep(0.3)
        assert command.poll() is None
        command.send_signal(number)
        assert command.wait(timeout=30) == 130
