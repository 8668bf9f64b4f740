"""Packed worlds: the files of a tar archive one after another, nothing ever unpacked to disk.

An archive is a stranger's file: what it inflates to is bounded, whatever its headers say, and
the names in it name worlds, never paths of ours.
"""

import gzip
import io
import lzma
import tarfile
import zlib
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path, PurePosixPath
from typing import IO

from ses_core.errors import WorldError
from storage.world_files import LARGEST_FILE_MIB, first_line

ARCHIVE_SUFFIXES = (".tar", ".tar.xz", ".txz", ".tar.gz", ".tgz")

_MOST_BYTES = 1 << 30
_MOST_MEMBERS = 200_000
_DICTIONARY_BYTES = 256 << 20
_BLOCK = 1 << 20
_PACKED_BLOCK = 1 << 16
"""What is left of it is copied for each stream that ends in it, and these can be tiny."""


def is_archive(path: Path) -> bool:
    """Tell by its name whether a file is an archive of worlds."""
    return path.name.lower().endswith(ARCHIVE_SUFFIXES)


def archived_files(path: Path) -> Iterator[tuple[Path, bytes]]:
    """Give the regular files of an archive: archive/name, and what the file holds.

    Raises:
        WorldError: It cannot be read, or inflates to more than is reasonable.
    """
    try:
        with (
            closing(_Bounded(_inflated(path), path)) as stream,
            tarfile.open(fileobj=io.BufferedReader(stream, _BLOCK), mode="r|") as archive,
        ):
            for number, member in enumerate(archive):
                if number >= _MOST_MEMBERS:
                    raise WorldError(f"{path} holds more than {_MOST_MEMBERS} files")
                if member.issparse():
                    raise WorldError(
                        f"{path} holds {member.name} with holes in it, expected plain files: pack "
                        "it without --sparse"
                    )
                file = archive.extractfile(member) if member.isreg() else None
                if file is None:
                    continue
                if member.size > LARGEST_FILE_MIB << 20:
                    raise WorldError(
                        f"{path} holds {member.name} of {member.size} bytes, "
                        f"expected at most {LARGEST_FILE_MIB} MiB"
                    )
                yield path / PurePosixPath(member.name).name, file.read()
    except (tarfile.TarError, lzma.LZMAError, zlib.error, OSError, EOFError) as error:
        raise WorldError(
            f"{path} cannot be read as an archive: {first_line(error)}, expected a whole tar file"
        ) from error


def _inflated(path: Path) -> IO[bytes]:
    name = path.name.lower()
    if name.endswith("xz"):
        return io.BufferedReader(_Xz(path), _BLOCK)
    if name.endswith("gz"):
        # The module hides that what it gives can be read like any file.
        return io.BufferedReader(gzip.GzipFile(path, "rb"), _BLOCK)
    return path.open("rb")


class _Bounded(io.RawIOBase):
    """A stream that ends in an error after so many bytes."""

    def __init__(self, stream: IO[bytes], path: Path) -> None:
        self._stream = stream
        self._path = path
        self._left = _MOST_BYTES

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        content = self._stream.read(min(len(buffer), _BLOCK))
        self._left -= len(content)
        if self._left < 0:
            raise WorldError(f"{self._path} inflates to more than {_MOST_BYTES >> 30} GiB")
        buffer[: len(content)] = content
        return len(content)

    def close(self) -> None:
        self._stream.close()
        super().close()


class _Xz(io.RawIOBase):
    """An xz file read within a bound on the dictionary, which `lzma.open` leaves to the file."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        self._decompressor = _xz_stream()

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        while True:
            packed = b""
            if self._decompressor.eof:
                # Tools that pack in parallel write streams one after another, padded by zeros.
                packed = self._decompressor.unused_data.lstrip(b"\0")
                while not packed:
                    packed = self._file.read(_PACKED_BLOCK)
                    if not packed:
                        return 0
                    packed = packed.lstrip(b"\0")
                self._decompressor = _xz_stream()
            elif self._decompressor.needs_input:
                packed = self._file.read(_PACKED_BLOCK)
                if not packed:
                    raise EOFError("it ends early")
            content = self._decompressor.decompress(packed, max_length=len(buffer))
            if content:
                buffer[: len(content)] = content
                return len(content)

    def close(self) -> None:
        self._file.close()
        super().close()


def _xz_stream() -> lzma.LZMADecompressor:
    return lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=_DICTIONARY_BYTES)
