"""`NumberedLog`: an append-only log of small files, 00000001.json and up.

An entry is put in place by a hard link that fails where the number is taken, so that of two
writers one retries and nothing that was acknowledged is ever replaced. Every entry carries
its own digest and its predecessor's, and lies on the disk twice: one damaged file loses
nothing.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ses_core.errors import ArtifactError
from ses_core.recipes import JsonValue, digest_bytes
from storage.durable_files import disk_errors, replace_file, write_if_absent
from storage.sealed_json import seal, unseal

NO_ENTRY = ""
"""Stands for the digest of the entry before the first."""


@dataclass(frozen=True, slots=True)
class LogEntry:
    """One entry: its number, the digest of its bytes and what it says."""

    number: int
    digest: str
    value: dict[str, JsonValue]


class NumberedLog:
    """The entries in one folder; several processes may append to it at once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def path(self, number: int) -> Path:
        """Give the file of an entry."""
        return self._folder / f"{number:08d}.json"

    def copy_path(self, number: int) -> Path:
        """Give the second file of an entry."""
        return self._folder / "copies" / f"{number:08d}.json"

    def read(self, number: int) -> LogEntry | None:
        """Read an entry, from its copy where the file is missing or damaged; None past the end.

        Raises:
            ArtifactError: Both are damaged.
        """
        damage: ArtifactError | None = None
        for path in (self.path(number), self.copy_path(number)):
            try:
                return _read(path, number)
            except FileNotFoundError:
                continue
            except ArtifactError as error:
                damage = damage or error
        if damage is not None:
            raise damage
        return None

    def after(self, number: int, digest: str) -> Iterator[LogEntry]:
        """Read the entries that follow one given by its number and digest, in order.

        Raises:
            ArtifactError: An entry is damaged, or does not follow the one before it.
        """
        while (entry := self.read(number + 1)) is not None:
            if entry.value["parent"] != digest:
                raise ArtifactError(
                    f"{self.path(entry.number)} follows an entry with digest "
                    f"{entry.value['parent']}, expected {digest}"
                )
            yield entry
            number, digest = entry.number, entry.digest

    def append(self, number: int, parent: str, content: Mapping[str, JsonValue]) -> LogEntry | None:
        """Put an entry in place after the one with the digest `parent`.

        Returns:
            The entry, or None where another writer has taken the number.
        """
        if self.read(number) is not None:
            return None
        # A writer killed before it made its copy left that to the next one.
        if number > 1:
            self._copy(number - 1)
        value: dict[str, JsonValue] = {**content, "number": number, "parent": parent}
        entry = seal(value)
        if not write_if_absent(self.path(number), entry):
            return None
        write_if_absent(self.copy_path(number), entry)
        return LogEntry(number, digest_bytes(entry), value)

    def damaged_files(self, entry: LogEntry) -> list[Path]:
        """Name those of an entry's two files that are not as it was written.

        The copy of the newest entry may be missing: its writer was killed before making it.
        """
        path, copy = self.path(entry.number), self.copy_path(entry.number)
        damaged = [] if _digest(path) == entry.digest else [path]
        return damaged if _digest(copy) in (entry.digest, None) else [*damaged, copy]

    def restore(self, entry: LogEntry, path: Path) -> None:
        """Write one of an entry's two files again, from the other."""
        for source in (self.path(entry.number), self.copy_path(entry.number)):
            if _digest(source) == entry.digest:
                replace_file(path, source.read_bytes())

    def _copy(self, number: int) -> None:
        source, target = self.path(number), self.copy_path(number)
        if not target.exists():
            with disk_errors(source):
                write_if_absent(target, source.read_bytes())


def _digest(path: Path) -> str | None:
    return digest_bytes(path.read_bytes()) if path.exists() else None


def _read(path: Path, number: int) -> LogEntry:
    content = path.read_bytes()
    value = unseal(content, source=path)
    if value.get("number") != number:
        raise ArtifactError(f"{path} holds entry {value.get('number')}, expected {number}")
    return LogEntry(number, digest_bytes(content), value)
