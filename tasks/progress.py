"""Progress of a stage: a bar in the Prefect UI and a line in the log, from shares of 0 to 1."""

import logging
import time
from collections.abc import Callable
from typing import cast
from uuid import UUID

from prefect.artifacts import create_progress_artifact, update_progress_artifact
from prefect.context import FlowRunContext, TaskRunContext
from prefect.logging import get_logger, get_run_logger

INTERVAL_S = 2.0


def report_progress(
    stage: str, *, clock: Callable[[], float] = time.monotonic
) -> Callable[[float], None]:
    """Give the callback that a stage tells its share done; cheap to call as often as one likes.

    At most every two seconds it says more than nothing, so a stage that is done sooner stays
    silent and makes no artifact. Outside of a run there is no artifact, only the log.

    Args:
        stage: Its name, as `--refresh` and the table of stages have it.
        clock: Monotonic seconds.
    """
    logger = _logger()
    in_run = TaskRunContext.get() is not None or FlowRunContext.get() is not None
    last = clock()
    has_spoken = False
    artifact: UUID | None = None

    def progress(share: float) -> None:
        nonlocal last, has_spoken, artifact
        now = clock()
        is_end = share >= 1.0 and has_spoken
        if now - last < INTERVAL_S and not is_end:
            return
        last, has_spoken = now, True
        percent = 100.0 * min(max(share, 0.0), 1.0)
        logger.info("%s %.0f %%", stage, percent, extra={"stage": stage, "share": percent / 100.0})
        if not in_run:
            return
        if artifact is None:
            created = create_progress_artifact(
                percent, key=f"progress-{stage}", description=f"Share done of: {stage}"
            )
            artifact = cast("UUID", created)
        else:
            update_progress_artifact(artifact, progress=percent)

    return progress


def _logger() -> "logging.Logger | logging.LoggerAdapter[logging.Logger]":
    if TaskRunContext.get() is None and FlowRunContext.get() is None:
        return get_logger("ses")
    return get_run_logger()
