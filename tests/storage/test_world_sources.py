import gzip
import io
import json
import lzma
import math
import tarfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ses_core.arrays import BoolArray
from ses_core.errors import WorldError
from ses_core.occupancy import draw, occupied_at
from ses_core.worlds.cellular_automata import (
    COURSE_GOAL,
    COURSE_START,
    barn_course,
    generate_barn_world,
)
from storage import world_archives, world_sources
from storage.barn_files import BarnArray, read_barn_array
from storage.world_sets import find_worlds, read_worlds, write_world_set
from storage.world_sources import Reading
from tests.shared_data import shared_data

FIELD, PATH = (lambda made: (made.field, made.path))(generate_barn_world(4, seed=1))


def _npy(array: object) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.asarray(array), allow_pickle=False)
    return buffer.getvalue()


def _tar(path: Path, files: dict[str, bytes]) -> Path:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as archive:
        for name, content in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    content = buffer.getvalue()
    if path.suffix != ".tar":
        content = gzip.compress(content) if path.suffix == ".gz" else lzma.compress(content)
    path.write_bytes(content)
    return path


def _plan(verts: object) -> bytes:
    return json.dumps({"id": "h", "verts": verts, "room_category": {}}).encode()


@pytest.mark.parametrize("suffix", ["tar", "tar.gz", "tar.xz"])
def test_worlds_are_read_out_of_archives_by_number(tmp_path: Path, suffix: str) -> None:
    archive = _tar(
        tmp_path / f"barn.{suffix}",
        {
            "BARN/grid_10.npy": _npy(FIELD.astype(np.int64)),
            "BARN/grid_2.npy": _npy(np.rot90(FIELD, 2)),
            "BARN/path_files/path_10.npy": _npy(PATH),
            "BARN/readme.txt": b"about",
            "../../plan.json": _plan([[0, 0], [4, 0], [4, 3], [0, 3]]),
            "bad.world": b"<sdf><world>",
        },
    )
    found = find_worlds([archive])
    assert [world.name for world in found.worlds] == ["grid_2", "grid_10", "plan"]
    assert np.array_equal(found.worlds[1].grid.cells, barn_course(FIELD).cells)
    assert found.worlds[1].course == (COURSE_START, COURSE_GOAL)
    assert [path.name for path in found.passed_over] == ["path_10.npy", "readme.txt"]
    assert len(found.refused) == 1
    assert "bad.world is no XML" in found.refused[0]
    assert sorted(path.name for path in tmp_path.iterdir()) == [archive.name]


def test_an_archive_that_inflates_without_end_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(world_archives, "_MOST_BYTES", 10 << 20)
    bomb = _tar(tmp_path / "bomb.tar.xz", {"a.bin": bytes(20 << 20)})
    assert bomb.stat().st_size < 10_000
    with pytest.raises(WorldError, match="inflates to more than"):
        read_worlds([bomb])


def test_a_damaged_archive_is_refused(tmp_path: Path) -> None:
    whole = _tar(tmp_path / "a.tar.xz", {"grid_1.npy": _npy(FIELD)}).read_bytes()
    (tmp_path / "cut.tar.xz").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.tar.gz").write_bytes(b"no archive")
    huge = lzma.compress(
        b"x", format=lzma.FORMAT_XZ, filters=[{"id": lzma.FILTER_LZMA2, "dict_size": 1 << 30}]
    )
    (tmp_path / "greedy.tar.xz").write_bytes(huge)
    for name in ("cut.tar.xz", "text.tar.gz", "greedy.tar.xz"):
        with pytest.raises(WorldError, match=f"{name} cannot be read as an archive"):
            read_worlds([tmp_path / name])


def test_links_in_an_archive_lead_nowhere(tmp_path: Path) -> None:
    (tmp_path / "secret.json").write_bytes(_plan([[0, 0], [4, 0], [4, 3]]))
    with tarfile.open(tmp_path / "links.tar", "w") as archive:
        for kind in (tarfile.SYMTYPE, tarfile.LNKTYPE):
            member = tarfile.TarInfo("plan.json")
            member.type, member.linkname = kind, str(tmp_path / "secret.json")
            archive.addfile(member)
    with pytest.raises(WorldError, match="no world in"):
        read_worlds([tmp_path / "links.tar"])


def test_a_path_gives_start_and_goal_where_that_is_asked_for(tmp_path: Path) -> None:
    np.save(tmp_path / "grid_7.npy", FIELD)
    (tmp_path / "path_files").mkdir()
    np.save(tmp_path / "path_files" / "path_7.npy", PATH)
    by_path = Reading(barn_course="path")
    (world,) = find_worlds([tmp_path], reading=by_path).worlds
    assert world.course is not None
    start, goal = world.course
    assert start.yaw == pytest.approx(math.pi / 2)
    assert (start.x, goal[0]) == pytest.approx(
        (-4.5 + 0.15 * (PATH[0, 0] + 0.5), -4.5 + 0.15 * (PATH[-1, 0] + 0.5))
    )
    assert (start.y, goal[1]) == pytest.approx((5.1 + 0.075 - 1.0, COURSE_GOAL[1]))
    (by_protocol,) = find_worlds([tmp_path]).worlds
    assert by_protocol.course == (COURSE_START, COURSE_GOAL)
    # Sets of both keep both.
    write_world_set(tmp_path / "both", [world, by_protocol])
    assert len(read_worlds([tmp_path / "both"])) == 2
    (tmp_path / "path_files" / "path_7.npy").unlink()
    with pytest.raises(WorldError, match=r"grid_7 has no path, expected path_7\.npy"):
        find_worlds([tmp_path], reading=by_path)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.npy", _npy(np.zeros((4, 5, 6))), "no array of BARN's"),
        ("a.npy", _npy(PATH), "BARN's path, expected the world"),
        ("a.npy", b"\x93NUMPY rubbish", "no array of numbers"),
        ("a.json", b"{", "is no JSON"),
        ("a.json", b"{}", "has no outline"),
        ("a.json", b"[" * 100_000, "is no JSON"),
        ("a.json", _plan([[0, 0], [1, 1]]), r"expected \(3 or more, 2\)"),
        ("a.json", _plan([["a", 0], [1, 1], [2, 2]]), "no numbers"),
        ("a.json", _plan([[0, 0], [1e9, 0], [0, 1]]), "beyond any house"),
        ("a.json", _plan([[0, 0], [900, 0], [900, 900]]), "in metres"),
        ("a.txt", b"", "is no map, expected"),
    ],
)
def test_a_named_file_that_is_no_map_is_refused(
    tmp_path: Path, name: str, content: bytes, said: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(WorldError, match=said):
        read_worlds([tmp_path / name])


def test_a_bad_map_of_a_folder_does_not_end_the_import_of_the_others(tmp_path: Path) -> None:
    (tmp_path / "good.json").write_bytes(_plan([[0, 0], [4, 0], [4, 3], [0, 3]]))
    (tmp_path / "package.json").write_text('{"name": "no map"}')
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    (tmp_path / "bad.world").write_text("<sdf>")
    (tmp_path / "bad.npy").write_bytes(b"rubbish")
    found = find_worlds([tmp_path])
    assert [world.name for world in found.worlds] == ["good"]
    assert [path.name for path in found.passed_over] == ["metadata.yaml", "package.json"]
    assert [line.count("\n") for line in found.refused] == [0, 0]
    assert "bad.npy is no array of numbers" in found.refused[0]
    assert "bad.world is no XML" in found.refused[1]
    # Whoever drives in them wants all of them or none.
    with pytest.raises(WorldError, match=r"bad\.npy"):
        read_worlds([tmp_path])


def test_a_plan_is_drawn_in_its_own_coordinates(tmp_path: Path) -> None:
    outline = [[10, 5], [14, 5], [14, 7], [12, 7], [12, 9], [10, 9]]
    (tmp_path / "h.json").write_bytes(_plan(outline))
    (world,) = read_worlds([tmp_path / "h.json"])
    points = np.array([(11, 6), (13, 6), (11, 8), (13, 8), (9.8, 6), (11, 9.2)])
    assert occupied_at(world.grid, points).tolist() == [False, False, False, True, True, True]
    assert world.source == "houseexpo"
    # The 401 x 201 and 201 x 200 pixels of HouseExpo's own picture, the line among them.
    assert np.count_nonzero(~world.grid.cells) * 0.05**2 == pytest.approx(12.0, rel=0.03)


def test_a_plan_is_the_picture_upside_down(tmp_path: Path) -> None:
    """HouseExpo's picture of an outline with slopes, made the way its vis_maps makes it."""
    (tmp_path / "h.json").write_bytes(_plan([[0, 0], [6, 0], [6, 3], [4, 5], [0, 5]]))
    pixels: BoolArray = np.zeros((551, 651), dtype=np.bool_)
    y, x = np.indices(pixels.shape)
    x, y = x - 25, y - 25
    pixels[(x >= 0) & (x <= 600) & (y >= 0) & (y <= 500) & (x + y <= 900)] = True
    Image.fromarray(pixels).save(tmp_path / "h.png")
    drawn, pictured = read_worlds([tmp_path / "h.json", tmp_path / "h.png"], resolution=0.01)
    free = [np.count_nonzero(~world.grid.cells) for world in (drawn, pictured)]
    assert free[0] == pytest.approx(free[1], rel=0.02)
    differing = np.count_nonzero(_trimmed(drawn.grid.cells) != _trimmed(pictured.grid.cells)[::-1])
    assert differing < 0.02 * free[0], draw(drawn.grid.cells)


def _trimmed(cells: BoolArray) -> BoolArray:
    rows, columns = (np.flatnonzero(~cells.all(axis=axis)) for axis in (1, 0))
    cut = cells[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return cut[:99, :119]


@pytest.mark.slow
def test_all_three_hundred_original_worlds_are_read_from_their_archive() -> None:
    archive = shared_data("barn", "BARN_300_worlds_and_paths.tar.xz")
    loose = read_worlds([shared_data("barn", "world_150.world")])
    found = find_worlds([archive])
    assert [world.name for world in found.worlds] == [f"world_{number}" for number in range(300)]
    assert not found.refused
    assert found.worlds[150].world_id == loose[0].world_id


def test_a_header_that_claims_more_than_there_is_costs_no_memory(tmp_path: Path) -> None:
    def header(shape: str) -> bytes:
        text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
        text = text.ljust(117) + b"\n"
        return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text

    for shape in ("(1000000000000000, 2)", f"({10**30}, 2)", "(-1, 2)", "(3, 2)"):
        (tmp_path / "path_1.npy").write_bytes(header(shape) + bytes(40))
        with pytest.raises(WorldError, match=r"path_1\.npy is no array of numbers: its header"):
            read_worlds([tmp_path / "path_1.npy"])


def test_a_name_of_thousands_of_digits_is_a_name(tmp_path: Path) -> None:
    name = "9" * 5000 + ".npy"
    with tarfile.open(tmp_path / "a.tar", "w", format=tarfile.PAX_FORMAT) as archive:
        for named in (name, "grid_10.npy", "grid_2.npy"):
            content = _npy(np.roll(FIELD, len(named), axis=1))
            member = tarfile.TarInfo(named)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    assert len(find_worlds([tmp_path / "a.tar"]).worlds) == 3
    with pytest.raises(WorldError, match="has no path"):
        find_worlds([tmp_path / "a.tar"], reading=Reading(barn_course="path"))


def test_a_resolution_that_no_map_has_is_refused_in_one_line(tmp_path: Path) -> None:
    for resolution in (1e-7, 0.0, -1.0, 11.0, math.nan, math.inf):
        with pytest.raises(WorldError, match=r"m per cell, expected 0\.001 to 10$"):
            Reading(resolution=resolution)
    Image.fromarray(np.full((9, 9), 255, dtype=np.uint8)).save(tmp_path / "a.png")
    (tmp_path / "a.yaml").write_text("image: a.png\nresolution: 1.0e-7\norigin: [0, 0, 0]\n")
    with pytest.raises(WorldError, match=r"a\.yaml: resolution is 1e-07 m per cell"):
        read_worlds([tmp_path / "a.yaml"])


def test_a_file_with_holes_in_an_archive_is_refused(tmp_path: Path) -> None:
    # One byte of content; the other 200 MiB are a hole.
    member = tarfile.TarInfo("grid_1.npy")
    member.type, member.size = tarfile.GNUTYPE_SPARSE, 1
    header = bytearray(member.tobuf(tarfile.GNU_FORMAT))
    header[386:410] = b"%011o\0%011o\0" % (0, 1)
    header[483:495] = b"%011o\0" % (200 << 20)
    header[148:156] = b" " * 8
    header[148:156] = b"%06o\0 " % sum(header)
    (tmp_path / "a.tar").write_bytes(bytes(header) + bytes(512) + bytes(1024))
    with pytest.raises(WorldError, match=r"grid_1\.npy with holes in it, expected plain files"):
        read_worlds([tmp_path / "a.tar"])


@pytest.mark.parametrize("suffix", ["xz", "gz"])
def test_streams_one_after_another_are_one_archive(tmp_path: Path, suffix: str) -> None:
    whole = _tar(
        tmp_path / "a.tar", {"grid_1.npy": _npy(FIELD), "grid_2.npy": _npy(np.rot90(FIELD, 2))}
    ).read_bytes()
    pack = lzma.compress if suffix == "xz" else gzip.compress
    streams = [pack(whole[start : start + 3000]) for start in range(0, len(whole), 3000)]
    padding = bytes(8) if suffix == "xz" else b""
    packed = padding.join(streams)
    path = tmp_path / f"a.tar.{suffix}"
    path.write_bytes(packed + padding)
    assert [world.name for world in find_worlds([path]).worlds] == ["grid_1", "grid_2"]
    path.write_bytes(packed[: len(packed) - len(streams[-1]) - 40])
    with pytest.raises(WorldError, match="cannot be read as an archive"):
        find_worlds([path])


def test_paths_beside_worlds_are_read_once_a_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in range(5):
        np.save(tmp_path / f"grid_{number}.npy", np.roll(FIELD, number, axis=1))
        np.save(tmp_path / f"path_{number}.npy", PATH)
    read: list[str] = []

    def counted(path: Path, content: bytes) -> BarnArray:
        read.append(path.name)
        return read_barn_array(path, content)

    monkeypatch.setattr(world_sources, "read_barn_array", counted)
    assert len(find_worlds([tmp_path], reading=Reading(barn_course="path")).worlds) == 5
    # Once as the paths of the folder, once as a file that may be a world.
    assert read.count("path_3.npy") == 2
