"""What long work shows while it runs: a bar on a terminal, plain lines elsewhere; on stderr."""

import copy
import logging
import sys
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, TextIO

from ses_core.errors import SesError

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID

LINE_INTERVAL_S = 5.0


class ProgressDisplay:
    """Shows lines of text and, per stage, the share that is done."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream or sys.stderr
        self._bars: RichProgress | None = None
        self._bar_of_stage: dict[str, TaskID] = {}
        self._shown: dict[str, float] = {}

    def update(self, stage: str, share: float, text: str = "") -> None:
        """Show how much of a stage is done, from 0 to 1."""
        if self._stream.isatty():
            self._draw(stage, share, text)
            return
        now = time.monotonic()
        due = now - self._shown.get(stage, -LINE_INTERVAL_S) >= LINE_INTERVAL_S
        if due or share >= 1.0:
            self._shown[stage] = now
            self.line(f"{stage} {100 * share:.0f} % {text}".rstrip())

    def line(self, text: str) -> None:
        """Show a line, above the bars where there are any."""
        if self._bars is None:
            print(text, file=self._stream, flush=True)
        else:
            self._bars.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def _draw(self, stage: str, share: float, text: str) -> None:
        # rich loads only where something is drawn: most commands are over before it would be.
        from rich.console import Console
        from rich.progress import Progress

        if self._bars is None:
            self._bars = Progress(console=Console(file=self._stream), transient=True)
            self._bars.start()
        if stage not in self._bar_of_stage:
            self._bar_of_stage[stage] = self._bars.add_task(stage, total=1.0)
        described = f"{stage} {text}".rstrip()
        bar = self._bar_of_stage[stage]
        self._bars.update(bar, completed=share, description=described, refresh=True)
        if share >= 1.0:
            self._bars.remove_task(self._bar_of_stage.pop(stage))
        if not self._bar_of_stage:
            self.close()

    def close(self) -> None:
        """Give the terminal back."""
        if self._bars is not None:
            self._bars.stop()
            self._bars = None
            self._bar_of_stage.clear()


class ConsoleHandler(logging.Handler):
    """Shows Prefect's log records; those that carry `stage` and `share` move that stage's bar.

    Prefect's logging configuration names it as the class of its `console` handler, which is why
    it takes that handler's arguments.
    """

    def __init__(
        self, stream: TextIO | None = None, styles: Mapping[str, str] | None = None
    ) -> None:
        super().__init__()
        del styles
        self._display = ProgressDisplay(stream)

    def emit(self, record: logging.LogRecord) -> None:
        """Show a record."""
        stage, share = getattr(record, "stage", None), getattr(record, "share", None)
        if isinstance(stage, str) and isinstance(share, float):
            self._display.update(stage, share)
        elif not _says_nothing(record):
            self._display.line(self.format(_without_foreseen_traceback(record)))

    def close(self) -> None:
        """Give the terminal back."""
        self._display.close()
        super().close()


def _says_nothing(record: logging.LogRecord) -> bool:
    """Tell whether Prefect only says that all is well: three hundred times in a large night."""
    return record.getMessage().startswith(
        ("Finished in state Completed", "Finished in state Cached")
    )


def _without_foreseen_traceback(record: logging.LogRecord) -> logging.LogRecord:
    """Leave the traceback of an error that we raised on purpose to the Prefect UI."""
    if record.exc_info is None or not isinstance(record.exc_info[1], SesError):
        return record
    bare = copy.copy(record)
    bare.exc_info = bare.exc_text = None
    return bare
