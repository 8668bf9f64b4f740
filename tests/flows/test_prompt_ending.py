"""A command ends soon after a signal, though a thread of it cannot be interrupted."""

import signal
import subprocess
import sys
import time

import pytest

BUSY = """
import signal, threading, time
from flows.prompt_ending import end_soon_after_signals

end_soon_after_signals(0.2)
signal.signal(signal.SIGTERM, lambda *_: None)
worker = threading.Thread(target=time.sleep, args=(60,))
worker.start()
print("busy", flush=True)
while worker.is_alive():
    try:
        worker.join()
    except KeyboardInterrupt:
        continue
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_busy_thread_does_not_keep_an_interrupted_command_alive(number: signal.Signals) -> None:
    with subprocess.Popen([sys.executable, "-c", BUSY], stdout=subprocess.PIPE) as command:
        assert command.stdout is not None
        assert command.stdout.readline() == b"busy\n"
        time.sleep(0.3)
        assert command.poll() is None
        command.send_signal(number)
        assert command.wait(timeout=30) == 130
