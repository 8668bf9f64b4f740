"""An interrupted command ends soon, also while a compiled loop or a training keeps a thread busy.

Prefect waits for its task threads, and a thread cannot be interrupted. Everything that is
finished is committed, so nothing is lost by not waiting longer than a moment.
"""

import os
import signal
import socket
import threading
import time

GRACE_S = 5.0
"""Time for Prefect to note on its server that the run was ended."""

INTERRUPTED = 130


def end_soon_after_signals(grace_s: float = GRACE_S) -> None:
    """From now on, end this process a moment after SIGINT or SIGTERM whatever its threads do.

    Handlers stay as they are and run as ever: signals are heard of beside them.
    """
    ear, mouth = socket.socketpair()
    mouth.setblocking(False)
    signal.set_wakeup_fd(mouth.fileno(), warn_on_full_buffer=False)

    def listen() -> None:
        with ear, mouth:
            while (heard := ear.recv(1)) and heard[0] not in (signal.SIGINT, signal.SIGTERM):
                continue
            time.sleep(grace_s)
            os._exit(INTERRUPTED)

    threading.Thread(target=listen, name="prompt ending", daemon=True).start()
