"""The content of one artifact: a folder of files and the manifest whose digest names it.

The manifest lists every file with its size and digest; the digest of the manifest itself is
the name of the artifact. A single flipped bit anywhere is therefore found.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from ses_core.errors import ArtifactError
from ses_core.recipes import JsonValue, canonical_json, digest_bytes
from storage.durable_files import replace_file, sync_file, sync_folder, write_if_absent


class FileDroppedError(ArtifactError):
    """A file of an artifact was given up to save space, on purpose."""


MANIFEST_NAME = ".manifest.json"

_DROPPED_NAME = ".dropped.json"


@dataclass(frozen=True, slots=True)
class ObjectFile:
    """One file of an artifact: where below its folder, how many bytes, and their digest."""

    path: str
    size: int
    sha256: str


def seal_object(folder: Path) -> str:
    """Digest, sync and write-protect everything in a folder, and write its manifest.

    Returns:
        The digest that names the content.

    Raises:
        ArtifactError: The folder holds something that is neither a file nor a folder.
    """
    files = []
    folders = [folder]
    for path in sorted(folder.rglob("*")):
        if path.is_symlink() or not (path.is_file() or path.is_dir()):
            raise ArtifactError(f"{path} is neither a file nor a folder, expected nothing else")
        if path.is_dir():
            folders.append(path)
            continue
        # People read these files through hard links in `tables`: they must not write to them.
        path.chmod(0o444)
        sync_file(path)
        size = path.stat().st_size
        files.append(ObjectFile(path.relative_to(folder).as_posix(), size, digest_file(path)))
    content = _manifest(files)
    write_if_absent(folder / MANIFEST_NAME, content)
    for below in folders[1:]:
        sync_folder(below)
    return digest_bytes(content)


def read_manifest(folder: Path, digest: str) -> tuple[ObjectFile, ...]:
    """List the files of an artifact.

    Raises:
        ArtifactError: The manifest is missing or not the one its digest names.
    """
    path = folder / MANIFEST_NAME
    try:
        content = path.read_bytes()
    except FileNotFoundError as error:
        raise ArtifactError(f"{path} is missing") from error
    if digest_bytes(content) != digest:
        raise ArtifactError(f"{path} is damaged: it has digest {digest_bytes(content)}")
    files: list[Mapping[str, object]] = json.loads(content)["files"]
    return tuple(
        ObjectFile(str(file["path"]), int(str(file["size"])), str(file["sha256"])) for file in files
    )


def check_size(folder: Path, file: ObjectFile) -> os.stat_result:
    """Check that a file of an artifact is there and has its size.

    Raises:
        ArtifactError: It is missing or longer or shorter.
    """
    path = folder / file.path
    try:
        status = path.lstat()
    except (FileNotFoundError, NotADirectoryError) as error:
        raise ArtifactError(f"{path} is missing") from error
    if status.st_size != file.size:
        raise ArtifactError(f"{path} has {status.st_size} bytes, expected {file.size}")
    return status


def check_content(folder: Path, file: ObjectFile) -> None:
    """Check every byte of a file of an artifact.

    Raises:
        ArtifactError: Its digest is another.
    """
    path = folder / file.path
    found = digest_file(path)
    if found != file.sha256:
        raise ArtifactError(f"{path} has digest {found}, expected {file.sha256}")


def check_object(folder: Path, digest: str) -> None:
    """Check every byte of an artifact.

    Raises:
        ArtifactError: A file is missing or not what the digest names.
    """
    files = read_manifest(folder, digest)
    dropped = dropped_files(folder)
    for file in files:
        if file.path not in dropped:
            check_size(folder, file)
            check_content(folder, file)


def digest_file(path: Path) -> str:
    """Digest a file's bytes: 64 hexadecimal digits of SHA-256."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def drop_files(folder: Path, names: Iterable[str]) -> None:
    """Give up files of an artifact to save space; from now on their absence is no damage."""
    dropped = dropped_files(folder) | set(names)
    replace_file(folder / _DROPPED_NAME, canonical_json(sorted(dropped)).encode())
    for name in dropped:
        (folder / name).unlink(missing_ok=True)


def dropped_files(folder: Path) -> frozenset[str]:
    """Name the files of an artifact that were given up to save space."""
    path = folder / _DROPPED_NAME
    return frozenset(json.loads(path.read_bytes())) if path.exists() else frozenset()


def _manifest(files: Iterable[ObjectFile]) -> bytes:
    listed: list[JsonValue] = [
        {"path": file.path, "size": file.size, "sha256": file.sha256}
        for file in sorted(files, key=lambda file: file.path)
    ]
    return canonical_json({"files": listed}).encode()
