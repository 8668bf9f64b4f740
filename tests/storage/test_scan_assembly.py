from collections import Counter
from dataclasses import replace

import numpy as np

from ses_core.geometry import Pose2D
from ses_core.robot_profile import GENERIC, LaserProfile
from storage.collected_streams import CollectedStreams
from storage.message_decoding import Scans, Transforms
from storage.scan_assembly import assemble_scans

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
UPRIGHT, ROLLED = (0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0)


def scan(beams: int = 5, increment: float = 0.1, ranges: list[float] | None = None) -> Scans:
    readings = np.array([ranges or [1.0] * beams], dtype=np.float32)
    geometry = np.array([[-0.2, increment, 0.5, 4.0]], dtype=np.float32)
    return Scans("laser", np.array([START]), geometry, readings)


def streams_of(*scans: Scans) -> CollectedStreams:
    streams = CollectedStreams()
    streams.scans = [
        replace(item, stamps_ns=item.stamps_ns + k * SECOND) for k, item in enumerate(scans)
    ]
    return streams


def mounted(orientation: tuple[float, float, float, float]) -> CollectedStreams:
    streams = streams_of(scan())
    streams.add_transforms([transform((0.3, 0.1, 0.2), orientation)], is_static=True)
    return streams


def transform(
    position: tuple[float, float, float],
    orientation: tuple[float, float, float, float] = UPRIGHT,
    *,
    later_ns: int = 0,
) -> Transforms:
    stamps = np.array([START + later_ns])
    return Transforms("base_link", "laser", stamps, np.array([position]), np.array([orientation]))


def test_an_upright_laser_keeps_its_angles_and_one_upside_down_turns_them() -> None:
    for orientation, sign in ((UPRIGHT, 1.0), (ROLLED, -1.0)):
        stream = assemble_scans(mounted(orientation), GENERIC, "base_link")
        assert stream is not None
        assert stream.mount == Pose2D(0.3, 0.1, 0.0)
        np.testing.assert_allclose(stream.angles, sign * np.linspace(-0.2, 0.2, 5), atol=1e-9)


def test_every_way_of_saying_nothing_came_back_is_infinity() -> None:
    readings = [0.0, float("nan"), float("inf"), 0.49, 4.0, -1.0, 0.5, 3.99]
    stream = assemble_scans(streams_of(scan(ranges=readings)), GENERIC, "base_link")
    assert stream is not None
    np.testing.assert_array_equal(np.isfinite(stream.ranges[0]), [False] * 6 + [True] * 2)


def test_without_transforms_the_profile_says_where_the_laser_sits() -> None:
    profile = GENERIC.model_copy(update={"laser": LaserProfile(mount_x_m=0.7)})
    streams = streams_of(scan())
    stream = assemble_scans(streams, profile, "base_link")
    assert stream is not None
    assert stream.mount == Pose2D(0.7, 0.0, 0.0)
    assert streams.warnings["mount_assumed"] == 1


def test_a_transform_that_moves_is_no_mount() -> None:
    streams = streams_of(scan())
    for k in range(3):
        streams.add_transforms([transform((0.1 * k, 0.0, 0.0), later_ns=k)], is_static=False)
    assemble_scans(streams, GENERIC, "base_link")
    assert streams.warnings["mount_assumed"] == 1


def test_empty_scans_and_scans_of_another_geometry_are_dropped_and_counted() -> None:
    streams = streams_of(
        scan(), scan(), scan(beams=7), scan(increment=0.0), scan(ranges=[1.0]), scan()
    )
    stream = assemble_scans(streams, GENERIC, "base_link")
    assert stream is not None
    assert len(stream.stamps_ns) == 3
    expected = Counter({"dropped_empty_scan": 2, "dropped_scan_geometry": 1, "mount_assumed": 1})
    assert +streams.warnings == expected


def test_scans_come_out_in_order_of_time_whatever_form_they_have() -> None:
    scans = [scan(ranges=[1.0 + k] * 5) for k in range(4)]
    streams = streams_of(*scans)
    streams.scans = [streams.scans[k] for k in (2, 0, 3, 1)]
    stream = assemble_scans(streams, GENERIC, "base_link")
    assert stream is not None
    assert stream.ranges[:, 0].tolist() == [1.0, 2.0, 3.0, np.inf]
    assert "reordered" not in streams.warnings


def test_of_static_transforms_the_last_in_time_counts() -> None:
    streams = streams_of(scan())
    for x, later in ((0.3, 5), (0.1, 0)):
        streams.add_transforms([transform((x, 0.0, 0.0), later_ns=later)], is_static=True)
    stream = assemble_scans(streams, GENERIC, "base_link")
    assert stream is not None
    assert stream.mount.x == 0.3
