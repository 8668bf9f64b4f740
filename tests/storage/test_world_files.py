import math
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from ses_core.arrays import ByteArray
from ses_core.errors import NotAMapError, WorldError
from ses_core.occupancy import occupied_at
from storage.world_files import read_image, read_map_server, read_pixels
from tests.shared_data import shared_data

FREE, WALL, UNKNOWN = 254, 0, 205
MAP = "image: floor.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n"


def _picture() -> ByteArray:
    """A map 8 x 6 pixels as map savers write it: unknown around, free inside, one wall pixel."""
    pixels = np.full((6, 8), UNKNOWN, dtype=np.uint8)
    pixels[2:5, 3:7] = FREE
    pixels[2, 3] = WALL  # top left of the free part
    return pixels


def _write_map(folder: Path, *, extra: str = "", pixels: ByteArray | None = None) -> Path:
    Image.fromarray(_picture() if pixels is None else pixels).save(folder / "floor.pgm")
    path = folder / "floor.yaml"
    path.write_text(
        "image: floor.pgm\nresolution: 0.1\norigin: [-1.0, 2.0, 0.0]\n"
        f"occupied_thresh: 0.65\n{extra}"
    )
    return path


def test_a_map_is_read_where_its_yaml_puts_it(tmp_path: Path) -> None:
    world = read_map_server(_write_map(tmp_path, extra="free_thresh: 0.196\nnegate: 0\n"))
    # Pixel (row 4, column 3), free, lies at x = -1 + 3.5 * 0.1, y = 2 + (6 - 4 - 0.5) * 0.1.
    points = np.array([(-0.65, 2.15), (-0.65, 2.35), (-0.55, 2.35), (-0.75, 2.15)])
    assert occupied_at(world.grid, points).tolist() == [False, True, False, True]
    assert np.count_nonzero(~world.grid.cells) == 11
    assert (world.name, world.source) == ("floor", "map_server")


def test_what_a_map_does_not_know_is_no_ground_whatever_the_threshold(tmp_path: Path) -> None:
    world = read_map_server(_write_map(tmp_path, extra="free_thresh: 0.25\n"))
    assert np.count_nonzero(~world.grid.cells) == 11


def test_a_negated_map_reads_dark_as_free(tmp_path: Path) -> None:
    pixels = np.full((4, 4), 255, dtype=np.uint8)
    pixels[1, 1:3] = 0
    world = read_map_server(_write_map(tmp_path, extra="negate: 1\n", pixels=pixels))
    assert np.count_nonzero(~world.grid.cells) == 2


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("image: floor.pgm\norigin: [0, 0, 0]\n", "resolution: field required"),
        ("image: floor.pgm\nresolution: -1\norigin: [0, 0, 0]\n", "greater than 0"),
        ("image: gone.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n", "names the image gone.pgm"),
        (MAP + "occupied_thresh: 0.1\n", "free_thresh should be less"),
        (MAP + "mode: shaded\n", "mode: input should be"),
        ("image: floor.pgm\nresolution: 1\norigin: [0, .nan, 0]\n", "three finite numbers"),
        ("- a\n- b\n", "expected the keys image"),
        ("{", "is no YAML"),
        ("a: &a [*a]\n", "expected the keys image"),
        ("[" * 2000, "is no YAML"),
        ("a: 2026-99-99\n", "is no YAML"),
    ],
)
def test_a_bad_map_is_refused_with_its_reason(tmp_path: Path, content: str, said: str) -> None:
    path = _write_map(tmp_path)
    path.write_text(content)
    with pytest.raises(WorldError, match=said) as refusal:
        read_map_server(path)
    assert "floor" in str(refusal.value) or "gone" in str(refusal.value)


@pytest.mark.parametrize("mode", ["1", "L", "RGB", "RGBA", "P", "I;16"])
def test_images_of_every_depth_give_the_same_cells(tmp_path: Path, mode: str) -> None:
    light = np.full((5, 7), 0, dtype=np.uint8)
    light[1:4, 2:6] = 255
    image = Image.fromarray(light)
    if mode == "I;16":
        image = Image.fromarray(light.astype(np.uint16) * 257)
    elif mode != "L":
        image = image.convert(mode)
    image.save(tmp_path / "plan.png")
    world = read_image(tmp_path / "plan.png", resolution=0.05)
    assert world.grid.cells.shape == (5, 6)
    assert np.count_nonzero(~world.grid.cells) == 12


def test_a_fine_plan_is_coarsened_without_losing_a_thin_wall(tmp_path: Path) -> None:
    light = np.full((200, 200), 255, dtype=np.uint8)
    light[:, 101] = 0
    Image.fromarray(light).save(tmp_path / "plan.png")
    world = read_image(tmp_path / "plan.png", resolution=0.01)
    assert world.grid.resolution == pytest.approx(0.05)
    assert world.grid.cells.shape == (40, 40)
    assert world.grid.cells[:, 20].all()
    assert np.count_nonzero(world.grid.cells) == 40


def test_an_image_without_free_ground_or_that_is_none_is_refused(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((5, 5), dtype=np.uint8)).save(tmp_path / "dark.png")
    (tmp_path / "fake.png").write_bytes(b"\x89PNG\r\n\x1a\nnothing")
    with pytest.raises(WorldError, match="no cell is free"):
        read_image(tmp_path / "dark.png", resolution=0.1)
    with pytest.raises(WorldError, match="cannot be read as an image"):
        read_image(tmp_path / "fake.png", resolution=0.1)


@given(
    seed=st.integers(0, 10_000),
    shape=st.tuples(st.integers(3, 12), st.integers(3, 12)),
    resolution=st.sampled_from([0.03, 0.05, 0.1]),
    image=st.sampled_from(["pgm", "png"]),
    negate=st.booleans(),
    turns=st.sampled_from([0, 1, 2, 3, -1]),
)
@settings(deadline=None, max_examples=40)
def test_a_map_written_as_map_savers_do_reads_back_cell_for_cell(
    tmp_path_factory: pytest.TempPathFactory,
    seed: int,
    shape: tuple[int, int],
    resolution: float,
    image: str,
    negate: bool,
    turns: int,
) -> None:
    folder = tmp_path_factory.mktemp("map")
    rng = np.random.default_rng(seed)
    cells = np.ones(shape, dtype=np.bool_)
    cells[1:-1, 1:-1] = rng.random((shape[0] - 2, shape[1] - 2)) < 0.4
    cells[1, 1] = False
    shades = np.where(cells, WALL, FREE).astype(np.uint8)
    shades = np.where(cells & (rng.random(shape) < 0.3), UNKNOWN, shades).astype(np.uint8)
    written = np.where(negate, 255 - shades, shades).astype(np.uint8)[::-1]
    Image.fromarray(written).save(folder / f"map.{image}")
    x, y, yaw = -3.5, 7.25, turns * math.pi / 2
    (folder / "map.yaml").write_text(
        f"image: map.{image}\nresolution: {resolution}\norigin: [{x}, {y}, {yaw}]\n"
        f"negate: {int(negate)}\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    grid = read_map_server(folder / "map.yaml").grid
    # Every cell's middle in the frame of the map, and whether it was free.
    iy, ix = np.indices(shape)
    along, across = (ix + 0.5) * resolution, (iy + 0.5) * resolution
    points = np.column_stack(
        (
            (x + math.cos(yaw) * along - math.sin(yaw) * across).ravel(),
            (y + math.sin(yaw) * along + math.cos(yaw) * across).ravel(),
        )
    )
    assert np.array_equal(occupied_at(grid, points), cells.ravel())
    assert np.count_nonzero(~grid.cells) == np.count_nonzero(~cells)


def test_a_map_at_an_angle_is_laid_out_along_its_frames_axes(tmp_path: Path) -> None:
    pixels = np.full((40, 60), WALL, dtype=np.uint8)
    pixels[1:-1, 1:-1] = FREE
    path = _write_map(tmp_path, pixels=pixels)
    path.write_text(path.read_text().replace("[-1.0, 2.0, 0.0]", "[1.0, 2.0, 0.5]"))
    grid = read_map_server(path).grid
    away = np.array([(3.0, 2.0), (0.3, 0.3), (5.7, 3.7), (-0.5, 2.0), (6.5, 2.0), (3.0, 4.5)])
    turned = away @ np.array([(math.cos(0.5), math.sin(0.5)), (-math.sin(0.5), math.cos(0.5))])
    expected = [False, False, False, True, True, True]
    assert occupied_at(grid, turned + np.array((1.0, 2.0))).tolist() == expected
    assert np.count_nonzero(~grid.cells) == pytest.approx(38 * 58, rel=0.01)


@pytest.mark.parametrize(
    ("mode", "free"),
    [
        # trinary: below free_thresh; scale: the lighter half between the thresholds.
        ("trinary", [True, True, False, False, False, False]),
        ("scale", [True, True, True, False, False, False]),
        # raw: the value is the percentage itself.
        ("raw", [False, False, False, False, False, True]),
    ],
)
def test_the_mode_of_a_map_decides_what_its_shades_mean(
    tmp_path: Path, mode: str, free: list[bool]
) -> None:
    shades = np.array([255, 220, 180, 120, 60, 30], dtype=np.uint8)
    pixels = np.full((3, 8), shades[3] if mode != "raw" else 255, dtype=np.uint8)
    pixels[1, 1:7] = shades
    path = _write_map(tmp_path, extra=f"mode: {mode}\nfree_thresh: 0.2\n", pixels=pixels)
    grid = read_map_server(path).grid
    points = np.column_stack((-1.0 + 0.1 * (np.arange(6) + 1.5), np.full(6, 2.15)))
    assert (~occupied_at(grid, points)).tolist() == free


def test_a_real_map_keeps_only_what_was_explored() -> None:
    world = read_map_server(shared_data("maps", "zaki0929_2019jan17_expt04.yaml"))
    assert world.grid.width_m == pytest.approx(16.4, abs=0.2)
    assert world.grid.height_m == pytest.approx(12.3, abs=0.2)
    assert -50.0 < world.grid.origin[0] < 50.0


def test_colours_are_read_within_a_few_bytes_a_pixel(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (1000, 1000, 4), dtype=np.uint8)
    Image.fromarray(pixels).save(tmp_path / "plan.png")
    tracemalloc.start()
    lightness, opacity = read_pixels(tmp_path / "plan.png")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert np.allclose(lightness, pixels[..., :3].mean(axis=2) / 255.0, atol=1e-6)
    assert np.allclose(opacity, pixels[..., 3] / 255.0)
    assert lightness.dtype == opacity.dtype == np.dtype(np.float32)
    assert peak < 20 * lightness.size


def test_a_picture_that_would_be_run_as_a_program_is_not_opened(tmp_path: Path) -> None:
    Image.fromarray(np.full((9, 9), 255, dtype=np.uint8)).save(tmp_path / "a.eps")
    (tmp_path / "a.eps").rename(tmp_path / "a.png")
    with pytest.raises(WorldError, match=r"a\.png cannot be read as an image: cannot identify"):
        read_pixels(tmp_path / "a.png")


def test_a_large_or_deep_yaml_is_refused_in_a_moment(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    for text, said in (
        ("[" * 500_000 + "]" * 500_000, "nests 65 deep"),
        ("- " * 500_000, "nests 65 deep"),
        ("a: 1\n" * 220_000, "is larger than 1 MiB"),
    ):
        path.write_text(text)
        with pytest.raises(NotAMapError, match=said):
            read_map_server(path)
    path.write_text("".join(f"a{number}: 1\n" for number in range(20_000)))
    started = time.process_time()
    with pytest.raises(NotAMapError):
        read_map_server(path)
    assert time.process_time() - started < 3.0
