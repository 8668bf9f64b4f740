"""Decompression that stops at a limit, put in place of the unlimited one inside rosbags.

A few kilobytes of bz2 or zstd inflate to gigabytes; rosbags checks sizes only afterwards.
"""

import bz2
from pathlib import Path
from typing import Protocol

import lz4.frame  # type: ignore[import-untyped]  # ships no type information
from backports import zstd
from rosbags.rosbag1 import reader as rosbag1_reader
from rosbags.rosbag2 import storage_mcap

from ses_core.errors import LogError

CHUNK_LIMIT = 256 * 2**20
"""Most bytes one compressed chunk or message may hold; recorders cut chunks at about 1 MiB."""

_BLOCK = 2**20


class _Decompressor(Protocol):
    @property
    def eof(self) -> bool: ...

    def decompress(self, data: bytes, max_length: int = -1) -> bytes: ...


def bounded_bz2(data: bytes) -> bytes:
    """Inflate bz2 data of at most `CHUNK_LIMIT` bytes."""
    return _inflate(bz2.BZ2Decompressor(), data)


def bounded_lz4(data: bytes) -> bytes:
    """Inflate an lz4 frame of at most `CHUNK_LIMIT` bytes."""
    return _inflate(lz4.frame.LZ4FrameDecompressor(), data)


def bounded_zstd(data: bytes) -> bytes:
    """Inflate a zstd frame of at most `CHUNK_LIMIT` bytes."""
    return _inflate(zstd.ZstdDecompressor(), data)


def inflate_zstd_file(source: Path, target: Path, *, limit: int) -> int:
    """Inflate a zstd file of at most `limit` bytes and give its size.

    Raises:
        LogError: `decompress_bomb` or `truncated`.
    """
    written = 0
    with zstd.open(source, "rb") as packed, target.open("xb") as file:
        try:
            while block := packed.read(_BLOCK):
                written += len(block)
                if written > limit:
                    raise _bomb(source.name, limit)
                file.write(block)
        except EOFError as error:
            raise LogError("truncated", f"compressed file {source.name} ends early") from error
    return written


def bound_rosbags() -> None:
    """Make rosbags inflate chunks within the limit, for the rest of this process."""
    rosbag1_reader.decompressors["bz2"] = bounded_bz2
    rosbag1_reader.decompressors["lz4"] = bounded_lz4
    storage_mcap.DECOMPRESSORS["lz4"] = _bounded_mcap_lz4
    storage_mcap.DECOMPRESSORS["zstd"] = _bounded_mcap_zstd


def _bounded_mcap_lz4(data: bytes, declared: int) -> bytes:
    _require_within(declared)
    return bounded_lz4(data)


def _bounded_mcap_zstd(data: bytes, declared: int) -> bytes:
    _require_within(declared)
    return bounded_zstd(data)


def _inflate(decompressor: _Decompressor, data: bytes) -> bytes:
    content: bytes = decompressor.decompress(data, max_length=CHUNK_LIMIT + 1)
    if len(content) > CHUNK_LIMIT:
        raise _bomb("a chunk", CHUNK_LIMIT)
    if not decompressor.eof:
        raise LogError("truncated", f"a compressed chunk of {len(data)} bytes ends early")
    return content


def _require_within(declared: int) -> None:
    if declared > CHUNK_LIMIT:
        raise _bomb("a chunk", CHUNK_LIMIT)


def _bomb(what: str, limit: int) -> LogError:
    return LogError("decompress_bomb", f"{what} inflates beyond {limit} bytes")
