"""What a scorecard holds: its rows, and the distributions behind those that compare measures."""

from collections.abc import Mapping
from dataclasses import dataclass

from ses_core.arrays import FloatArray
from ses_core.scorecard.rows import ScorecardRow


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """One measure of the real (N,) and the synthesized (M,) environments; nan where unknown."""

    unit: str
    real: FloatArray
    synthesized: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Scorecard:
    """Rows, and the distributions behind those that compare measures, by the measure's name."""

    rows: tuple[ScorecardRow, ...]
    measures: Mapping[str, Measured]
