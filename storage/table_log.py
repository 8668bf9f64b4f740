"""`TableLog`: which parts the tables consist of, one atomic commit after the other.

The entries are the truth; the folders under `tables/` are a view of them that is brought up
to date after every commit and whenever the log is opened, so that a crash in between heals.
"""

import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import cast

from ses_core.errors import ArtifactError
from ses_core.recipes import JsonValue
from storage.durable_files import replace_file
from storage.file_lock import file_lock
from storage.layout import Layout
from storage.numbered_log import NO_ENTRY, LogEntry, NumberedLog
from storage.sealed_json import seal, unseal
from storage.table_parts import TablePart, part_from_json
from storage.table_view import TableView

_CHECKPOINT_EVERY = 50
_CHECKPOINTS_KEPT = 2


class TableLog:
    """The parts of all tables; several processes, and the threads of each, may commit at once.

    Opening it reads the whole list of parts, every later look only what has been added since: a
    night opens it once.
    """

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._log = NumberedLog(layout.table_log)
        self._view = TableView(layout)
        self._parts: dict[str, TablePart] = {}
        self._number = 0
        self._digest = NO_ENTRY
        self._lock = threading.RLock()
        self.publish()

    def parts(self, table: str) -> tuple[TablePart, ...]:
        """List the parts of a table as of now, in the order of their places."""
        with self._lock:
            self._refresh()
            found = [(slot, part) for slot, part in self._parts.items() if part.table == table]
        return tuple(part for _, part in sorted(found))

    def all_parts(self) -> tuple[TablePart, ...]:
        """List the parts of all tables as of now, in the order of their places."""
        with self._lock:
            self._refresh()
            return tuple(part for _, part in sorted(self._parts.items()))

    def commit(
        self, add: Sequence[TablePart], remove: Sequence[TablePart] = (), *, message: str
    ) -> int:
        """Add and remove parts in one step, and show the result.

        Parts that are there already, and removed ones that are not, change nothing: a night
        may commit again what it cannot know to be committed. An added part replaces the one
        of the same table, folder and name.

        Returns:
            Number of the entry that the tables are now at.

        Raises:
            ArtifactError: The artifact of an added part is missing, or the disk is failing.
        """
        for part in add:
            self._check_source(part)
        with self._lock:
            self._append(add, remove, message=message)
            self.publish()
            # A file that was damaged and built again must replace its damaged link.
            self._show_again(add)
            return self._number

    def publish(self, *, anew: bool = False) -> None:
        """Bring the folders under `tables/` up to the newest entry.

        Args:
            anew: Look at every part, not only at those that changed since the last time.
        """
        published = None if anew else self._view.published()
        if published is not None and self._log.read(published + 1) is None:
            return
        with self._lock, file_lock(self._layout.publish_lock):
            # Another process may have published in the meantime.
            published = None if anew else self._view.published()
            changes: dict[str, TablePart | None] = {}
            if published is None:
                self._refresh()
                self._view.prepare()
                changes.update(self._parts)
                number = self._number
            else:
                number = published
                while (entry := self._log.read(number + 1)) is not None:
                    changes.update(_changes(entry))
                    number = entry.number
            self._view.apply(changes, number=number)

    def _append(
        self, add: Sequence[TablePart], remove: Sequence[TablePart], *, message: str
    ) -> None:
        """Put an entry behind the newest one, unless it would change nothing."""
        while True:
            self._refresh()
            new = [part for part in add if self._parts.get(part.slot) != part]
            gone = [part for part in remove if part.slot in self._parts]
            if not new and not gone:
                return
            content: dict[str, JsonValue] = {
                "message": message,
                "created_stamp_ns": time.time_ns(),
                "add": [part.as_json() for part in new],
                "remove": [part.slot for part in gone],
            }
            entry = self._log.append(self._number + 1, self._digest, content)
            if entry is None:
                continue
            self._take(entry)
            if entry.number % _CHECKPOINT_EVERY == 0:
                self._save_checkpoint()
            return

    def _refresh(self) -> None:
        """Read the entries that came since the last time."""
        if self._number == 0:
            self._load_checkpoint()
        for entry in self._log.after(self._number, self._digest):
            self._take(entry)

    def _take(self, entry: LogEntry) -> None:
        for slot, part in _changes(entry).items():
            if part is None:
                self._parts.pop(slot, None)
            else:
                self._parts[slot] = part
        self._number, self._digest = entry.number, entry.digest

    def _show_again(self, parts: Sequence[TablePart]) -> None:
        hidden: dict[str, TablePart | None] = {
            part.slot: part
            for part in parts
            if self._parts.get(part.slot) == part and not self._view.shows(part)
        }
        if hidden:
            with file_lock(self._layout.publish_lock):
                self._view.apply(hidden, number=self._view.published() or 0)

    def _check_source(self, part: TablePart) -> None:
        path = self._layout.object_folder(part.ref) / part.file
        if not path.is_file() or path.stat().st_size != part.size:
            raise ArtifactError(f"{path} is missing or not of {part.size} bytes, expected a part")

    @property
    def _checkpoints(self) -> Path:
        return self._layout.table_log / "checkpoints"

    def _save_checkpoint(self) -> None:
        path = self._checkpoints / f"{self._number:08d}.json"
        parts = [part.as_json() for part in self._parts.values()]
        replace_file(path, seal({"number": self._number, "digest": self._digest, "parts": parts}))
        for old in sorted(self._checkpoints.glob("*.json"))[:-_CHECKPOINTS_KEPT]:
            old.unlink(missing_ok=True)

    def _load_checkpoint(self) -> None:
        """Start from the newest checkpoint that agrees with the entries; it is only a hint."""
        for path in sorted(self._checkpoints.glob("*.json"), reverse=True):
            try:
                value = unseal(path.read_bytes(), source=path)
                entry = self._log.read(int(str(value["number"])))
            except (ArtifactError, FileNotFoundError):
                continue
            if entry is not None and entry.digest == value["digest"]:
                self._number, self._digest = entry.number, entry.digest
                listed = cast("list[dict[str, JsonValue]]", value["parts"])
                self._parts = {part.slot: part for part in map(part_from_json, listed)}
                return


def _changes(entry: LogEntry) -> dict[str, TablePart | None]:
    """Give what an entry puts into each slot; None where it takes the part away."""
    removed = cast("list[str]", entry.value["remove"])
    added = cast("list[dict[str, JsonValue]]", entry.value["add"])
    changes: dict[str, TablePart | None] = dict.fromkeys(removed)
    changes.update((part.slot, part) for part in map(part_from_json, added))
    return changes
