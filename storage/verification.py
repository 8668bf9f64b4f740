"""`verify`: check every byte that the store has answered for, and mend what can be mended."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from enum import IntFlag
from pathlib import Path

from ses_core.errors import ArtifactError
from storage.artifact_store import move_to_corrupt, read_answer
from storage.durable_files import disk_errors, temporary_owner
from storage.layout import Layout
from storage.numbered_log import NO_ENTRY, NumberedLog
from storage.object_files import check_object
from storage.parquet_files import row_count
from storage.table_log import TableLog
from storage.table_schemas import TABLES
from storage.table_view import SCHEMA_FILE, TableView


class Damage(IntFlag):
    """What can be wrong; as bits, for scripts."""

    NONE = 0
    CORRUPT = 1
    FOREIGN = 2
    MISSING = 4


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is wrong, and what was done about it."""

    damage: Damage
    text: str
    repaired: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """What was looked at and what was wrong."""

    artifacts: int
    recipes: int
    entries: int
    parts: int
    findings: tuple[Finding, ...]

    def count(self, damage: Damage) -> int:
        """Count the findings of one kind."""
        return sum(finding.damage is damage for finding in self.findings)

    @property
    def damage(self) -> Damage:
        """Every kind of damage that is still there, as bits."""
        left = Damage.NONE
        for finding in self.findings:
            if not finding.repaired:
                left |= finding.damage
        return left


def verify(layout: Layout, *, repair: bool = False) -> Verification:
    """Check every artifact, recipe, log entry and visible table file.

    With `repair`, damaged artifacts and recipes are moved to `corrupt/`, recipes whose artifact
    is gone are forgotten (the next night builds them again), damaged log entries are restored
    from their copies, and the tables are shown anew.

    Raises:
        ArtifactError: The table log cannot be read, or the disk is failing.
    """
    verifier = _Verifier(layout, repair=repair)
    with disk_errors(layout.root):
        # The log first: without it the tables cannot even be opened.
        entries = sum(
            verifier.entries(NumberedLog(folder)) for folder in (layout.table_log, layout.registry)
        )
        artifacts = verifier.artifacts()
        recipes = verifier.recipes()
        parts = verifier.parts()
    return Verification(
        artifacts=artifacts,
        recipes=recipes,
        entries=entries,
        parts=parts,
        findings=tuple(verifier.findings),
    )


class _Verifier:
    """One pass over a store."""

    def __init__(self, layout: Layout, *, repair: bool) -> None:
        self._layout = layout
        self._repair = repair
        self.findings: list[Finding] = []

    def entries(self, log: NumberedLog) -> int:
        """Check both files of every entry."""
        count = 0
        for entry in log.after(0, NO_ENTRY):
            count += 1
            for path in log.damaged_files(entry):
                self._report(
                    Damage.CORRUPT,
                    f"log entry {path} is missing or damaged",
                    repaired=self._repair,
                )
                if self._repair:
                    log.restore(entry, path)
        return count

    def artifacts(self) -> int:
        """Check every byte of every artifact."""
        count = 0
        for folder in sorted(self._layout.objects.glob("*/*")):
            count += 1
            try:
                check_object(folder, folder.name)
            except ArtifactError as error:
                self._report(Damage.CORRUPT, str(error), repaired=self._repair)
                if self._repair:
                    move_to_corrupt(self._layout, folder)
        return count

    def recipes(self) -> int:
        """Check every recipe, and that its artifact is there."""
        count = 0
        for path in sorted(self._layout.recipes.glob("*/*.json")):
            count += 1
            try:
                ref = read_answer(path).ref
            except ArtifactError as error:
                self._report(Damage.CORRUPT, str(error), repaired=self._repair)
                if self._repair:
                    move_to_corrupt(self._layout, path)
                continue
            if not self._layout.object_folder(ref).is_dir():
                self._report(
                    Damage.MISSING,
                    f"recipe {path} is answered by {ref}, which is gone",
                    repaired=self._repair,
                )
                if self._repair:
                    path.unlink(missing_ok=True)
        return count

    def parts(self) -> int:
        """Compare what the tables show with what the log says, in both directions."""
        log, view = TableLog(self._layout), TableView(self._layout)
        parts = {part.slot: part for part in log.all_parts()}
        for slot, part in parts.items():
            if not (self._layout.object_folder(part.ref) / part.file).exists():
                self._report(
                    Damage.MISSING,
                    f"table part {slot} lost its artifact {part.ref}: run the night again",
                    repaired=False,
                )
                # Damaged bytes would make the whole table unreadable.
                if self._repair:
                    view.retire(slot)
            elif not view.shows(part):
                self._report(
                    Damage.MISSING,
                    f"table part {slot} is not shown, or not as committed",
                    repaired=self._repair,
                )
        for path in self._foreign_files(parts):
            self._report(Damage.FOREIGN, f"{path} is no part of its table", repaired=self._repair)
            if self._repair:
                move_to_corrupt(self._layout, path)
        if self._repair:
            log.publish(anew=True)
        return len(parts)

    def _foreign_files(self, slots: Collection[str]) -> Iterator[Path]:
        """Find files that pandas would read although no part is shown there."""
        for table in TABLES:
            folder = self._layout.table_folder(table)
            for path in sorted(folder.rglob("*")):
                if path.is_dir() or temporary_owner(path) is not None:
                    continue
                slot = path.relative_to(self._layout.tables).as_posix()
                if path != folder / SCHEMA_FILE and slot not in slots and not _is_empty(path):
                    yield path

    def _report(self, damage: Damage, text: str, *, repaired: bool) -> None:
        self.findings.append(Finding(damage, text, repaired))


def _is_empty(path: Path) -> bool:
    """Tell whether a file is what a part that was taken away is replaced by."""
    try:
        return row_count(path) == 0
    except ArtifactError:
        return False
