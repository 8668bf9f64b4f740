"""SES-GAN, mended and fitted with torch: the discriminator judges what is used.

Against the paper (`gan_paper`): generated environments are binarized before D sees them, the
loss does not saturate, and D's slope at real environments is kept low (R1) in place of batch
normalization and dropout. G ends and D begins in convolutions, and G draws walls as bands
between two fields (`gan_networks`). Real environments are mirrored at random, what D sees is
shifted so that it cannot learn the real ones by heart, and of the states of G's averaged
weights the one is kept that covers held-out environments best.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from numpy.random import Generator

from ses_core.navigation import NavigationDomain
from ses_core.protocols import FittedSynthesizer
from ses_core.synthesis.gan_training import GanTraining
from ses_core.synthesis.generator_network import GeneratorNetwork
from ses_core.synthesis.seeded_torch import one_seeded_thread
from ses_core.synthesis.snapshot_choice import SnapshotChoice, held_out
from ses_core.synthesis_settings import GanSettings


@dataclass(frozen=True, slots=True)
class Gan:
    """Trains generator and discriminator against each other."""

    settings: GanSettings

    def fit(
        self,
        domain: NavigationDomain,
        *,
        rng: Generator,
        progress: Callable[[float], None],
        start: FittedSynthesizer | None = None,
    ) -> GeneratorNetwork:
        """Train on occupied = +1, free = -1; equal seeds give equal weights.

        A warm start takes the generator's weights from an earlier fit, layer by layer where
        their shapes agree. An earlier fit holds no discriminator: this one begins anew and
        pulls at a good generator before it can judge, so the first epochs make it worse. Where
        nothing better comes of it, the generator it started from is what is given back, if
        there are enough environments to hold some out (300 by default).

        Leaves torch's random state and thread count as they were.
        """
        settings = self.settings
        cells = domain.cells()
        earlier = start if isinstance(start, GeneratorNetwork) else None
        taught, kept_back = held_out(domain, settings=settings)
        choice = SnapshotChoice(cells[kept_back], settings=settings, rng=rng.spawn(1)[0])
        with one_seeded_thread(int(rng.integers(2**63))):
            training = GanTraining(cells[taught], settings, earlier)
            epochs = training.epochs
            between = math.ceil(epochs / settings.snapshots)
            if earlier is not None:
                choice.consider(training.network())
            for epoch in range(1, epochs + 1):
                training.epoch()
                if epoch % between == 0 or epoch == epochs:
                    choice.consider(training.network())
                    if choice.is_over:
                        break
                progress(epoch / epochs)
        progress(1.0)
        return choice.best
