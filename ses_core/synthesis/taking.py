"""Samples are looked at in order: taken as they are, repaired, or passed over."""

from dataclasses import dataclass, field

import numpy as np

from ses_core.arrays import BoolArray
from ses_core.synthesis.repair import TOO_MANY, repair
from ses_core.synthesis.traversability import traversable
from ses_core.synthesis_settings import SynthesisSettings


@dataclass(slots=True, kw_only=True)
class Taking:
    """Environments taken so far, and what became of the other samples.

    Attributes:
        settings: `uncrossable` and `most_repaired_cells` matter.
        count: So many are to be taken.
        radius: Of the disc that has to get across [m].
        taken: Cells (30, 30) of distinct environments that can be crossed.
        drawn: Samples looked at.
        crossable: Samples that can be crossed as they are.
        beyond_repair: Samples passed over because a repair would change too many cells.
        repeated: Samples passed over because they equal one taken before.
        repairs: Cells changed in each environment that was repaired and taken.
    """

    settings: SynthesisSettings
    count: int
    radius: float
    taken: list[BoolArray] = field(default_factory=list)
    drawn: int = 0
    crossable: int = 0
    beyond_repair: int = 0
    repeated: int = 0
    repairs: list[int] = field(default_factory=list)
    _seen: set[bytes] = field(default_factory=set)

    @property
    def is_complete(self) -> bool:
        """Whether no more are needed."""
        return len(self.taken) >= self.count

    def look_at(self, samples: BoolArray) -> None:
        """Go through samples (S, 30, 30) until enough are taken; the rest is not counted."""
        can_be_crossed = traversable(samples, radius=self.radius)
        shipped, cleared = samples, np.where(can_be_crossed, 0, TOO_MANY)
        if self.settings.uncrossable == "repair":
            most = self.settings.most_repaired_cells
            shipped, cleared = repair(samples, radius=self.radius, most=most)
        for number in range(len(samples)):
            if self.is_complete:
                return
            self.drawn += 1
            self.crossable += bool(can_be_crossed[number])
            if cleared[number] != TOO_MANY:
                self._take(shipped[number], int(cleared[number]))
            elif self.settings.uncrossable == "repair":
                self.beyond_repair += 1

    def shortage(self) -> str:
        """Say in words why there are not enough."""
        reasons = [f"{self.crossable} can be crossed"]
        if self.settings.uncrossable == "repair":
            most = self.settings.most_repaired_cells
            reasons.append(f"{self.beyond_repair} would need more than {most} changed cells")
        reasons.append(f"{self.repeated} repeat another")
        return (
            f"{len(self.taken)} environments instead of {self.count}: "
            f"among {self.drawn} samples {', '.join(reasons)}"
        )

    def _take(self, cells: BoolArray, cleared: int) -> None:
        key = cells.tobytes()
        if key in self._seen:
            self.repeated += 1
            return
        self._seen.add(key)
        self.taken.append(cells)
        if cleared > 0:
            self.repairs.append(cleared)
