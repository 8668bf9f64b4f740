"""`TableView`: the folders under `tables/`, a view of the log that can be made again at any time.

Whoever lists a folder and then opens its files must find every one of them. Parts therefore
appear, and are replaced, by a rename; a part that is taken away is replaced by a file
without rows, never unlinked.
"""

import errno
import json
import os
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path

from storage.durable_files import (
    disk_errors,
    make_folder,
    replace_file,
    sync_file,
    sync_folder,
    temporary_name,
)
from storage.layout import Layout
from storage.object_files import digest_file
from storage.parquet_files import write_empty_table
from storage.table_parts import TablePart
from storage.table_schemas import SCHEMA_VERSION, TABLES

SCHEMA_FILE = "000-schema.parquet"
"""Keeps an empty table readable; sorts before all parts, so that its columns are the table's."""

_NO_LINKS = frozenset({errno.EXDEV, errno.EPERM, errno.EMLINK, errno.ENOTSUP})
"""What file systems say that have no hard links, or not enough of them."""


class TableView:
    """What `pandas.read_parquet` finds in the folders of the tables."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._hint = layout.tables / ".published.json"

    def published(self) -> int | None:
        """Tell up to which entry of the log the view was made; None where it must be made anew."""
        try:
            hint = json.loads(self._hint.read_bytes())
            number, version = int(hint["number"]), int(hint["schema_version"])
        except (OSError, ValueError, KeyError, TypeError):
            return None
        whole = all((self._layout.table_folder(name) / SCHEMA_FILE).exists() for name in TABLES)
        return number if whole and version == SCHEMA_VERSION else None

    def prepare(self) -> None:
        """Make every table's folder readable; a new one appears together with its first file."""
        for name in TABLES:
            folder = self._layout.table_folder(name)
            if folder.exists():
                write_empty_table(folder / SCHEMA_FILE, name)
                continue
            fresh = temporary_name(self._layout.staging / name)
            with disk_errors(folder):
                fresh.mkdir()
                write_empty_table(fresh / SCHEMA_FILE, name)
                fresh.rename(folder)
                sync_folder(folder.parent)

    def apply(self, changes: Mapping[str, TablePart | None], *, number: int) -> None:
        """Show parts by slot, take away those given as None, and note the entry this makes.

        A part whose artifact is gone stays as it is: `verify` finds it.
        """
        with disk_errors(self._layout.tables):
            for slot, part in changes.items():
                if part is None:
                    self.retire(slot)
                elif self._source(part).exists():
                    self.show(part)
            _sync_folders({(self._layout.tables / slot).parent for slot in changes})
        hint = {"number": number, "schema_version": SCHEMA_VERSION}
        replace_file(self._hint, json.dumps(hint).encode())

    def shows(self, part: TablePart) -> bool:
        """Tell whether a part's file is in its place: the artifact's own, or an equal copy."""
        source, target = self._source(part), self._layout.tables / part.slot
        if not (source.exists() and target.exists()):
            return False
        if source.samefile(target):
            return True
        return target.stat().st_size == part.size and digest_file(target) == part.sha256

    def show(self, part: TablePart) -> None:
        """Put a part's file in its place in one step, without storing its content twice."""
        if self.shows(part):
            return
        target = self._layout.tables / part.slot
        make_folder(target.parent)
        self._place(self._source(part), target)

    def retire(self, slot: str) -> None:
        """Replace what a slot shows by a file without rows."""
        target = self._layout.tables / slot
        if target.exists():
            self._place(self._layout.tables / slot.split("/")[0] / SCHEMA_FILE, target)

    def _source(self, part: TablePart) -> Path:
        return self._layout.object_folder(part.ref) / part.file

    def _place(self, source: Path, target: Path) -> None:
        temporary = temporary_name(target)
        try:
            try:
                os.link(source, temporary)
            except OSError as error:
                if error.errno not in _NO_LINKS:
                    raise
                shutil.copyfile(source, temporary)
                sync_file(temporary)
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)


def _sync_folders(folders: Iterable[Path]) -> None:
    for folder in folders:
        if folder.exists():
            sync_folder(folder)
