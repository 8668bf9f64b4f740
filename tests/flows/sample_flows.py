"""A flow for tests of what runs flows."""

import time

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from tasks.progress import report_progress


@task(name="sleep", cache_policy=NO_CACHE)
def sleep(seconds: float) -> float:
    progress = report_progress("train")
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        progress(1.0 - left / seconds)
        time.sleep(0.1)
    progress(1.0)
    return seconds


@flow(name="nap")
def nap(seconds: float = 0.0) -> float:
    """Sleep for a while."""
    return sleep.submit(seconds).result()
