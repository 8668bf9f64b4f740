"""What a fit's matrix products are, and that the comparison runs, not how fast."""

import runpy
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import nn

from ses_core.synthesis_settings import GanPaperSettings, GanSettings, SynthesizerSettings

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"

FITS: tuple[SynthesizerSettings, ...] = (
    GanPaperSettings(epochs=1, least_updates=1),
    GanSettings(epochs=1, least_updates=1),
)


def test_products_are_those_of_the_layers() -> None:
    products = runpy.run_path(str(BENCHMARKS / "_matrix_floor.py"))["products"]
    network = nn.Sequential(
        nn.Conv2d(1, 8, 4, 2, 1), nn.ReLU(), nn.Flatten(), nn.Linear(8 * 5 * 5, 3)
    )
    images = torch.zeros(6, 1, 10, 10)
    # 5 x 5 places, 16 cells under the kernel; 6 images.
    assert products(network, images, ("forward",)) == [(150, 16, 8), (6, 200, 3)]
    assert products(network, images, ("weights",)) == [(16, 150, 8), (200, 6, 3)]
    assert products(network, images, ("inputs",)) == [(150, 8, 16), (6, 3, 200)]
    assert products(network, images, ("all but first inputs",)) == [(6, 3, 200)]


def test_a_transposed_convolution_spreads_every_cell() -> None:
    products = runpy.run_path(str(BENCHMARKS / "_matrix_floor.py"))["products"]
    network = nn.Sequential(nn.ConvTranspose2d(2, 3, 4, 2, 1))
    assert products(network, torch.zeros(7, 2, 8, 8), ("forward",)) == [(7 * 64, 2, 3 * 16)]


def test_the_paper_costs_what_its_layers_say() -> None:
    """Multiply-adds per environment: 3 times G's, and of D's 6 while it learns and 4 after."""
    bench = runpy.run_path(str(BENCHMARKS / "_matrix_floor.py"))
    from ses_core.synthesis import gan_paper

    discriminator = gan_paper.build_discriminator(GanPaperSettings())
    shapes = bench["products"](discriminator, torch.zeros(2, 900), ("forward",))
    assert bench["Floor"](shapes).operations == 2 * 2 * (900 * 512 + 512 * 256 + 256 * 256 + 256)


def test_every_promise_has_a_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    measure = runpy.run_path(str(BENCHMARKS / "synthesis.py"))["measure"]

    rows = measure(tmp_path, environments=130, rounds=1, drawn=20, fitted_to=64, short_fits=FITS)

    names = [str(row["name"]) for row in rows]
    assert names[0].startswith("epoch of gan-paper, batches of ")
    assert names[1].startswith("epoch of gan, batches of ")
    assert names[2:] == [
        "20 environments of gan-paper: sampled, repaired",
        "20 environments of gan: sampled, repaired",
    ]
    assert all(row["ours"] > 0.0 and row["bar"] in {1.0, 2.0} for row in rows)


def test_benchmarked_rooms_are_not_all_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    rooms = runpy.run_path(str(BENCHMARKS / "synthesis.py"))["rooms"](50, seed=0)
    assert len(np.unique(rooms.reshape(50, -1), axis=0)) == 50
    assert 0.05 < rooms.mean() < 0.6
