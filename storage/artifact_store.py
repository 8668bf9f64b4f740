"""`LocalArtifactStore`: artifacts on a local disk, found by what was asked for.

What was asked (`recipes/<stage>/<key>.json`) and what came out (`objects/<kind>/<digest>/`)
are kept apart: a stage that runs again and gives the same bytes moves nothing downstream.
The recipe file is the commit point: a crash before it leaves nothing that anyone would find.
"""

import errno
import os
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ses_core.errors import ArtifactError
from ses_core.recipes import ArtifactRef, JsonValue, Recipe, Stage, parse_ref
from storage.durable_files import (
    MACHINE_FAULTS,
    disk_errors,
    make_folder,
    replace_file,
    sync_folder,
    temporary_name,
    write_if_absent,
)
from storage.file_lock import file_lock
from storage.layout import Layout, open_layout
from storage.object_files import (
    FileDroppedError,
    ObjectFile,
    check_content,
    check_size,
    dropped_files,
    read_manifest,
    seal_object,
)
from storage.sealed_json import seal, unseal

_Signature = tuple[int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What a recipe file says.

    Attributes:
        recipe: The recipe as JSON: stage, version, settings, inputs.
        seconds: How long it took to build [s].
        size: Bytes of the artifact.
    """

    ref: ArtifactRef
    recipe: dict[str, JsonValue]
    seconds: float
    created_stamp_ns: int
    size: int


class LocalArtifactStore:
    """Keeps artifacts under one root; several processes may use it at once."""

    def __init__(self, root: Path) -> None:
        self._layout = open_layout(root)
        # Files whose content was checked by this process, as they were then.
        self._checked: dict[tuple[ArtifactRef, str], _Signature] = {}

    @property
    def layout(self) -> Layout:
        """Where everything lies."""
        return self._layout

    def find(self, recipe: Recipe) -> ArtifactRef | None:
        """Give the artifact that answers a recipe, or None; a damaged one is moved away."""
        path = self._recipe_path(recipe)
        try:
            ref = read_answer(path).ref
            self._check(ref, contents=False)
        except ArtifactError:
            return None
        with suppress(OSError):
            os.utime(path)  # Last use: what garbage collection goes by.
        return ref

    def put(self, recipe: Recipe, build: Callable[[Path], None]) -> ArtifactRef:
        """Build into an empty folder, then commit it as the answer to a recipe.

        A recipe that has its answer is not built again. Of two processes that build the same
        recipe at once, both get the artifact of the one that committed first.

        Raises:
            ArtifactError: The disk is full or failing. Errors of `build` pass through. In any
                case nothing is left behind.
        """
        found = self.find(recipe)
        if found is not None:
            return found
        started = time.perf_counter()
        staging = temporary_name(self._layout.staging / recipe.stage.name)
        try:
            with disk_errors(staging, only=MACHINE_FAULTS):
                staging.mkdir()
                build(staging)
            with disk_errors(staging):
                ref = ArtifactRef(recipe.stage.name, seal_object(staging))
                with file_lock(self._layout.sweep_lock, shared=True):
                    self._place(staging, ref)
            return self._commit(recipe, ref, time.perf_counter() - started)
        finally:
            shutil.rmtree(staging, ignore_errors=True)

    def path(self, ref: ArtifactRef) -> Path:
        """Give the folder of an artifact, checked against its digest.

        Sizes are checked always, bytes once per process.

        Raises:
            ArtifactError: It is missing or damaged; a damaged one is moved away, so that the
                next `put` of its recipe builds it again.
        """
        self._check(ref, contents=True)
        return self._layout.object_folder(ref)

    def file(self, ref: ArtifactRef, name: str) -> Path:
        """Give one file of an artifact, checking that file alone; see `path`.

        Raises:
            FileDroppedError: It was given up to save space.
            ArtifactError: It is missing or damaged.
        """
        self._check(ref, contents=True, name=name)
        return self._layout.object_folder(ref) / name

    def files(self, ref: ArtifactRef) -> tuple[ObjectFile, ...]:
        """List the files of an artifact.

        Raises:
            ArtifactError: It is missing or damaged.
        """
        return self._check(ref, contents=False)

    def answer(self, recipe: Recipe) -> Answer | None:
        """Give all that is known of how a recipe was answered, or None."""
        try:
            return read_answer(self._recipe_path(recipe))
        except ArtifactError:
            return None

    def answers(self, stage: Stage) -> list[Answer]:
        """List how recipes of a stage, in its present version, were answered, newest first.

        Damaged recipe files are left out; whether the artifacts are still there is not looked at.
        """
        found: list[Answer] = []
        for path in self._layout.recipe_file(stage.name, "any").parent.glob("*.json"):
            with suppress(ArtifactError):
                found.append(read_answer(path))
        found = [answer for answer in found if answer.recipe["version"] == stage.version]
        return sorted(found, key=lambda one: (one.created_stamp_ns, one.ref), reverse=True)

    def forget(self, recipe: Recipe) -> None:
        """Drop the answer to a recipe, so that it is built again; its artifact stays."""
        path = self._recipe_path(recipe)
        with disk_errors(path):
            path.unlink(missing_ok=True)

    def _recipe_path(self, recipe: Recipe) -> Path:
        return self._layout.recipe_file(recipe.stage.name, recipe.key())

    def _check(
        self, ref: ArtifactRef, *, contents: bool, name: str | None = None
    ) -> tuple[ObjectFile, ...]:
        folder = self._layout.object_folder(ref)
        if not folder.is_dir():
            raise ArtifactError(f"artifact {ref} is missing, expected it at {folder}")
        with disk_errors(folder):
            try:
                files = read_manifest(folder, ref.digest)
                dropped = dropped_files(folder)
                for file in files:
                    if file.path not in dropped and name in (None, file.path):
                        self._check_file(ref, folder, file, contents=contents)
            except ArtifactError as damage:
                moved = move_to_corrupt(self._layout, folder)
                raise ArtifactError(
                    f"artifact {ref} is damaged: {damage}; moved to {moved}, run again to rebuild"
                ) from damage
        if name is not None and name in dropped:
            raise FileDroppedError(f"{folder / name} was dropped: it is older than the retention")
        if name is not None and name not in {file.path for file in files}:
            raise ArtifactError(f"artifact {ref} has no file {name!r}")
        return files

    def _check_file(
        self, ref: ArtifactRef, folder: Path, file: ObjectFile, *, contents: bool
    ) -> None:
        status = check_size(folder, file)
        signature = (status.st_ino, status.st_mtime_ns, status.st_size)
        if not contents or self._checked.get((ref, file.path)) == signature:
            return
        check_content(folder, file)
        self._checked[ref, file.path] = signature

    def _place(self, staging: Path, ref: ArtifactRef) -> None:
        """Give a sealed folder its name, unless the same content already has it.

        Either way the artifact is young afterwards, so that it is not collected as one that
        nothing leads to before its recipe does.
        """
        target = self._layout.object_folder(ref)
        make_folder(target.parent)
        while True:
            try:
                staging.rename(target)
            except OSError as error:
                if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                    raise
            else:
                sync_folder(target.parent)
                return
            try:
                self._check(ref, contents=True)
            except ArtifactError:
                if target.exists():
                    raise
                continue  # It was damaged and has been moved away: its place is free.
            os.utime(target)
            return

    def _commit(self, recipe: Recipe, ref: ArtifactRef, seconds: float) -> ArtifactRef:
        """Link the recipe to its artifact: from here on it is answered."""
        path = self._recipe_path(recipe)
        content = seal(
            {
                "recipe": recipe.as_json(),
                "ref": str(ref),
                "seconds": round(seconds, 3),
                "created_stamp_ns": time.time_ns(),
                "size": sum(file.size for file in self._check(ref, contents=False)),
            }
        )
        if write_if_absent(path, content):
            return ref
        winner = self.find(recipe)
        if winner is not None:
            return winner
        # What is there is damaged, or its artifact is gone.
        replace_file(path, content)
        return ref


def read_answer(path: Path) -> Answer:
    """Read a recipe file.

    Raises:
        ArtifactError: It is missing or damaged.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError as error:
        raise ArtifactError(f"{path} is missing") from error
    value = unseal(content, source=path)
    recipe = value["recipe"]
    assert isinstance(recipe, dict)
    return Answer(
        ref=parse_ref(str(value["ref"])),
        recipe=recipe,
        seconds=float(str(value["seconds"])),
        created_stamp_ns=int(str(value["created_stamp_ns"])),
        size=int(str(value["size"])),
    )


def move_to_corrupt(layout: Layout, path: Path) -> Path:
    """Move a damaged file or folder out of the way, keeping it for whoever looks for the cause."""
    relative = path.relative_to(layout.root)
    target = layout.corrupt / f"{'-'.join(relative.parts)}.{time.time_ns()}"
    with disk_errors(path):
        make_folder(layout.corrupt)
        with suppress(FileNotFoundError):  # Another process was faster.
            path.rename(target)
    return target
