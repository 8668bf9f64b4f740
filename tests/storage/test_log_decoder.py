"""The limited process: what it refuses, what it survives, and that good logs pass unharmed."""

import os
import resource
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ses_core.errors import LogError
from ses_core.extraction.recording import PoseStream, Recording, ScanStream
from ses_core.extraction.tabled_drives import TabledLog
from ses_core.geometry import Pose2D
from ses_core.robot_profile import GENERIC
from ses_core.settings import DecoderLimits
from storage.log_decoder import decode_log
from storage.log_formats import CARMEN, make_reader
from storage.quarantine import REASONS
from storage.recording_files import (
    read_recording,
    read_tabled_log_back,
    write_recording,
    write_tabled_log,
)
from tests.log_factory import drive, write_carmen, write_log
from tests.storage.hostile_logs import HOSTILE, bz2_bomb

MEBIBYTE = 2**20


def decode(path: Path, name: str, tmp_path: Path, **limits: float) -> Recording:
    return decode_log(
        path,
        format=name,
        profile=GENERIC,
        pose_source="odometry",
        limits=DecoderLimits.model_validate(limits),
        workdir=tmp_path / "work",
    )


def test_a_good_log_comes_through_the_wall_whole(tmp_path: Path) -> None:
    path, name = write_log(tmp_path, "mcap")
    recording = decode(path, name, tmp_path)
    content = drive()
    np.testing.assert_allclose(recording.poses.poses, content.poses.poses, atol=1e-12)
    assert recording.scans is not None
    assert recording.map is not None
    assert recording.warnings == {}
    assert list((tmp_path / "work").iterdir()) == []


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_logs_are_refused_for_their_reason(case: str, tmp_path: Path) -> None:
    make, expected = HOSTILE[case]
    path, name = make(tmp_path)
    # The same code as in the child, without the time a process takes to start.
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    from storage.decoder_child import decode_request

    output = tmp_path / "output"
    output.mkdir()
    request: Mapping[str, object] = {
        "wanted": "recording",
        "log": str(path),
        "format": name,
        "profile": GENERIC.model_dump(mode="json"),
        "pose_source": "odometry",
        "limits": DecoderLimits().model_dump(mode="json"),
        "output": str(output),
    }
    outcome = decode_request(request, scratch=scratch)
    assert outcome["reason"] in expected, outcome
    assert outcome["reason"] in REASONS


def test_a_bomb_neither_grows_the_parent_nor_ends_it(tmp_path: Path) -> None:
    path, name = bz2_bomb(tmp_path)
    assert path.stat().st_size < 10_000
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(LogError) as error:
        decode(path, name, tmp_path)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert error.value.reason == "decompress_bomb"
    assert grown * 1024 < 50 * MEBIBYTE


def test_a_log_that_takes_too_long_is_stopped(tmp_path: Path) -> None:
    path, name = write_log(tmp_path, "bag")
    with pytest.raises(LogError) as error:
        decode(path, name, tmp_path, wall_s=0.01)
    assert error.value.reason == "time_limit"


def test_a_log_larger_than_allowed_is_not_even_opened(tmp_path: Path) -> None:
    path = tmp_path / "large.bag"
    with path.open("wb") as file:
        file.truncate(2 * MEBIBYTE)
    with pytest.raises(LogError) as error:
        decode(path, "rosbag1", tmp_path, log_mib=1)
    assert error.value.reason == "size_limit"


def test_the_child_sees_no_environment_of_ours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Isolated mode and an empty environment: neither can a planted module be imported.
    (tmp_path / "rosbags.py").write_text("raise SystemExit('planted')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("PYTHONOPTIMIZE", "2")
    path, name = write_log(tmp_path, "bag")
    assert decode(path, name, tmp_path).messages_in > 0
    assert os.environ["PYTHONOPTIMIZE"] == "2"


def test_what_the_child_hands_over_is_checked(tmp_path: Path) -> None:
    (tmp_path / "log").mkdir()
    path = write_carmen(tmp_path / "a.log", ["ODOM 0 0 0 0 0 0 1.0 h 1.0"] * 2)
    reader = make_reader(CARMEN, limits=DecoderLimits(), workdir=tmp_path)
    recording = reader.read(path, profile=GENERIC, pose_source="odometry")
    write_recording(tmp_path / "log", recording)
    assert len(read_recording(tmp_path / "log", byte_limit=MEBIBYTE).poses.poses) > 0
    for name, array in (
        ("poses", np.zeros((2, 4))),
        ("poses", np.zeros((7, 3))),
        ("poses", np.full((2, 3), np.nan)),
        ("pose_stamps", np.array([2.0, 1.0])),
        ("pose_stamps", np.array([2, 1])),
        ("poses", np.array([[object()] * 3] * 2)),
    ):
        whole = (tmp_path / "log" / f"{name}.npy").read_bytes()
        np.save(tmp_path / "log" / f"{name}.npy", array, allow_pickle=True)
        with pytest.raises(LogError) as error:
            read_recording(tmp_path / "log", byte_limit=MEBIBYTE)
        assert error.value.reason == "decoder_bug"
        (tmp_path / "log" / f"{name}.npy").write_bytes(whole)
    with pytest.raises(LogError):
        read_recording(tmp_path / "log", byte_limit=10)


@pytest.mark.parametrize(
    ("stamps", "said"),
    [
        ([0, 8 * 10**18, -9 * 10**18, -8 * 10**18], "go backwards"),
        ([-1, 0, 1, 2], "not between 1970 and 2100"),
        ([0, 1, 2, 5 * 10**18], "not between 1970 and 2100"),
    ],
)
@pytest.mark.parametrize("stream", ["poses", "scans"])
def test_stamps_that_no_clock_gives_are_refused(
    tmp_path: Path, stream: str, stamps: list[int], said: str
) -> None:
    scans = ScanStream(
        stamps_ns=np.arange(4),
        ranges=np.ones((4, 2), dtype=np.float32),
        angles=np.zeros(2),
        range_max=9.0,
        mount=Pose2D(0.0, 0.0),
    )
    recording = replace(_recording(), scans=scans)
    changed = replace(getattr(recording, stream), stamps_ns=np.array(stamps))
    write_recording(tmp_path, replace(recording, **{stream: changed}))
    with pytest.raises(LogError, match=said) as error:
        read_recording(tmp_path, byte_limit=MEBIBYTE)
    assert error.value.reason == "decoder_bug"


@pytest.mark.parametrize("first_steps", [[2**63 - 1, 0], [5, 0], [0, 1], [0, 2**62]])
def test_drives_whose_steps_overlap_are_refused(tmp_path: Path, first_steps: list[int]) -> None:
    log = TabledLog(
        recording=_recording(),
        first_steps=np.array(first_steps),
        lengths=np.array([2, 2]),
        scan_poses=np.empty((0, 3)),
    )
    write_tabled_log(tmp_path, log)
    with pytest.raises(LogError, match=r"overlap|step numbers"):
        read_tabled_log_back(tmp_path, byte_limit=MEBIBYTE)


def _recording() -> Recording:
    return Recording(
        poses=PoseStream(stamps_ns=np.arange(4), poses=np.zeros((4, 3)), twists=np.zeros((4, 2))),
        commands=None,
        scans=None,
        map=None,
        pose_source="odometry",
        has_clock=True,
        messages_in=8,
        messages_used=8,
    )
