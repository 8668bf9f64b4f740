"""The Prefect server as a child: `server_process DESCRIPTOR private|scheduling`."""

import socket
import sys

import uvicorn
from prefect.server.api.server import create_app


def main() -> None:
    """Serve on a listening socket that the parent opened, so that no port is raced for.

    A private server lives for one command: it keeps the record of runs, but has no pages and
    starts nothing on schedule.
    """
    descriptor, kind = sys.argv[1:]
    application = create_app(ephemeral=kind == "private", final=True)
    configuration = uvicorn.Config(
        application, log_level="warning", access_log=False, timeout_graceful_shutdown=3
    )
    uvicorn.Server(configuration).run([socket.socket(fileno=int(descriptor))])


if __name__ == "__main__":
    main()
