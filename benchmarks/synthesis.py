"""What fitting a GAN costs next to its own matrix products, and what drawing from a fit costs.

A fit's row is an epoch over as many environments as the paper has, with its share of looking
at snapshots; the ratio is how many times the CPU time of its matrix products that is, and at
most 2 is promised. Rounds alternate between both sides, on one thread, because other work on
the machine comes and goes. Drawing's rows say how long 1,000 environments take to sample
(ours) and to repair (theirs); their ratio is the sum of both over the 5 s promised. The fits
they are drawn from are short, which makes more to repair.
"""

import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from _matrix_floor import Floor, Shape, products
from torch import Tensor, nn

from ses_core.arrays import BoolArray
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from ses_core.robot_profile import JACKAL
from ses_core.synthesis import gan_paper
from ses_core.synthesis.factory import make_synthesizer
from ses_core.synthesis.gan_training import GanTraining
from ses_core.synthesis.repair import repair
from ses_core.synthesis.seeded_torch import one_seeded_thread
from ses_core.synthesis.snapshot_choice import SnapshotChoice
from ses_core.synthesis_settings import (
    AutoregressiveSettings,
    GanPaperSettings,
    GanSettings,
    SynthesisSettings,
    SynthesizerSettings,
)

SEED = 11
PAPER_ENVIRONMENTS = 3769
FLOOR_BAR = 2.0
DRAWING_BAR_S = 5.0

SHORT_FITS: tuple[SynthesizerSettings, ...] = (
    GanPaperSettings(epochs=10, least_updates=1),
    GanSettings(epochs=10, least_updates=1),
    AutoregressiveSettings(updates=100),
)

Row = dict[str, str | float]


def measure(
    scratch: Path,
    *,
    environments: int = PAPER_ENVIRONMENTS,
    rounds: int = 3,
    drawn: int = 1000,
    fitted_to: int = 500,
    short_fits: tuple[SynthesizerSettings, ...] = SHORT_FITS,
) -> list[Row]:
    """Measure an epoch of both GANs, and drawing from every method that learns."""
    del scratch  # nothing is written
    cells = rooms(environments, seed=SEED)
    with one_seeded_thread(SEED):
        fits = [
            _paper_row(cells, GanPaperSettings(), rounds),
            _mended_row(cells, GanSettings(), rounds),
        ]
    domain = _domain(cells[:fitted_to])
    return [*fits, *(_drawing_row(settings, domain, drawn) for settings in short_fits)]


def rooms(count: int, *, seed: int) -> BoolArray:
    """Draw rooms (count, 30, 30) with a wall across, a doorway in it, and boxes about."""
    rng = np.random.default_rng(seed)
    cells = np.zeros((count, 30, 30), dtype=np.bool_)
    for place in cells:
        for _ in range(4):
            y, x, height, width = rng.integers((0, 0, 2, 2), (28, 28, 9, 9))
            place[y : y + height, x : x + width] = True
        row, column = rng.integers(4, 24), rng.integers(0, 25)
        place[row : row + 2] = True
        place[row - 2 : row + 4, column : column + 6] = False
    return cells


def _paper_row(cells: BoolArray, settings: GanPaperSettings, rounds: int) -> Row:
    generator = gan_paper.build_generator(settings)
    discriminator = gan_paper.build_discriminator(settings)
    signs = np.where(cells, np.float32(1.0), np.float32(-1.0)).reshape(len(cells), -1)
    size = min(settings.batch_size, len(cells))
    both = torch.randn(2 * size, gan_paper.PIXELS)
    floor = Floor(
        [
            *_generator_products(generator, torch.randn(size, settings.latent_size)),
            *products(discriminator, both, ("forward", "weights", "all but first inputs")),
            # Its batch normalization is over both halves, so the real ones are judged again.
            *products(discriminator, both, ("forward", "inputs")),
        ]
    )
    training = gan_paper.train(generator, discriminator, torch.from_numpy(signs), settings=settings)
    return _epoch_row(
        f"gan-paper, batches of {size}",
        lambda: next(training),
        floor,
        updates=len(cells) // size,
        rounds=rounds,
    )


def _mended_row(cells: BoolArray, settings: GanSettings, rounds: int) -> Row:
    training = GanTraining(cells, settings, None)
    choice = SnapshotChoice(
        cells[: int(settings.heldout_share * len(cells))],
        settings=settings,
        rng=np.random.default_rng(SEED),
    )
    size = training.batch_size
    images = torch.randn(2 * size, 1, 30, 30)
    floor = Floor(
        [
            *_generator_products(training.generator, torch.randn(size, settings.latent_size)),
            *products(
                training.discriminator, images, ("forward", "weights", "all but first inputs")
            ),
            *products(training.discriminator, images[:size], ("forward", "inputs")),
        ]
    )
    network = training.network()
    looking = statistics.median(_cpu_time(lambda: choice.consider(network)) for _ in range(rounds))
    return _epoch_row(
        f"gan, batches of {size}",
        training.epoch,
        floor,
        updates=training.batches,
        rounds=rounds,
        besides=looking * settings.snapshots / training.epochs,
    )


def _generator_products(generator: nn.Sequential, noise: Tensor) -> list[Shape]:
    return products(generator, noise, ("forward", "weights", "all but first inputs"))


def _epoch_row(
    name: str,
    epoch: Callable[[], object],
    floor: Floor,
    *,
    updates: int,
    rounds: int,
    besides: float = 0.0,
) -> Row:
    """Compare an epoch, and what comes `besides` [s], with the products of its updates."""
    ours, least = [], []
    epoch()  # makes the optimisers' memory, once per fit
    for _ in range(rounds):
        least.append(floor.seconds(updates))
        ours.append(_cpu_time(epoch) + besides)
    fastest, median = statistics.median(least), statistics.median(ours)
    rate = floor.operations * updates / fastest / 1e9
    return {
        "name": f"epoch of {name} ({rate:.0f} GFLOP/s)",
        "unit": "s",
        "ours": round(median, 3),
        "theirs": round(fastest, 3),
        "ratio": round(median / fastest, 2),
        "bar": FLOOR_BAR,
    }


def _drawing_row(settings: SynthesizerSettings, domain: NavigationDomain, drawn: int) -> Row:
    """Time sampling and repairing, after a first time that compiles what needs compiling."""
    fitted = make_synthesizer(settings, environments=drawn).fit(
        domain, rng=np.random.default_rng(SEED), progress=lambda _: None
    )
    most = SynthesisSettings().most_repaired_cells

    def sample(count: int) -> BoolArray:
        radius = JACKAL.inscribed_radius_m
        return fitted.sample(count, rng=np.random.default_rng(SEED), radius=radius)

    repair(sample(2), radius=JACKAL.inscribed_radius_m, most=most)
    begun = time.perf_counter()
    cells = sample(drawn)
    sampled = time.perf_counter()
    repair(cells, radius=JACKAL.inscribed_radius_m, most=most)
    repaired = time.perf_counter()
    return {
        "name": f"{drawn} environments of {settings.method}: sampled, repaired",
        "unit": "s",
        "ours": round(sampled - begun, 3),
        "theirs": round(repaired - sampled, 3),
        "ratio": round((repaired - begun) / DRAWING_BAR_S, 3),
        "bar": 1.0,
    }


def _cpu_time(work: Callable[[], object]) -> float:
    begun = time.process_time()
    work()
    return time.process_time() - begun


def _domain(cells: BoolArray) -> NavigationDomain:
    return NavigationDomain(
        tuple(
            NavigationEnvironment(
                environment_id=f"room-{number}",
                cells=place,
                observed=np.ones_like(place),
                origin="map",
                scenario_id=f"room-{number}",
            )
            for number, place in enumerate(cells)
        )
    )
