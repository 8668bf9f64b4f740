import bz2
from collections.abc import Callable
from pathlib import Path

import lz4.frame  # type: ignore[import-untyped]  # ships no type information
import pytest
from backports import zstd
from rosbags.rosbag1 import reader as rosbag1_reader

from ses_core.errors import LogError
from storage import bounded_decompression
from storage.bounded_decompression import (
    bound_rosbags,
    bounded_bz2,
    bounded_lz4,
    bounded_zstd,
    inflate_zstd_file,
)

Pack = Callable[[bytes], bytes]
CODECS: list[tuple[Pack, Pack]] = [
    (bz2.compress, bounded_bz2),
    (lz4.frame.compress, bounded_lz4),
    (zstd.compress, bounded_zstd),
]


@pytest.mark.parametrize(("pack", "inflate"), CODECS, ids=["bz2", "lz4", "zstd"])
def test_chunks_inflate_up_to_the_limit_and_no_further(
    pack: Pack, inflate: Pack, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bounded_decompression, "CHUNK_LIMIT", 1000)
    assert inflate(pack(bytes(1000))) == bytes(1000)
    with pytest.raises(LogError) as error:
        inflate(pack(bytes(1001)))
    assert error.value.reason == "decompress_bomb"


@pytest.mark.parametrize(("pack", "inflate"), CODECS, ids=["bz2", "lz4", "zstd"])
def test_a_chunk_that_ends_early_is_truncated(pack: Pack, inflate: Pack) -> None:
    with pytest.raises(LogError) as error:
        inflate(pack(bytes(range(256)) * 9)[:-8])
    assert error.value.reason == "truncated"


def test_rosbags_inflates_through_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    bound_rosbags()
    monkeypatch.setattr(bounded_decompression, "CHUNK_LIMIT", 10)
    with pytest.raises(LogError):
        rosbag1_reader.decompressors["bz2"](bz2.compress(bytes(11)))


def test_a_compressed_file_inflates_up_to_its_limit(tmp_path: Path) -> None:
    packed = tmp_path / "a.zst"
    packed.write_bytes(zstd.compress(bytes(5000)))
    assert inflate_zstd_file(packed, tmp_path / "whole", limit=5000) == 5000
    with pytest.raises(LogError) as error:
        inflate_zstd_file(packed, tmp_path / "part", limit=4999)
    assert error.value.reason == "decompress_bomb"
