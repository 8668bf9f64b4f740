"""What a page says of a scorecard: its rows in groups, in words and rounded (leaf: scipy)."""

from collections.abc import Sequence
from dataclasses import dataclass

from ses_core.scorecard.driving import DRIVEN_MEASURES
from ses_core.scorecard.result import Scorecard
from ses_core.scorecard.rows import ScorecardRow
from ses_core.scorecard.sample_rows import MANIFOLD_METRICS
from ses_core.scorecard.standing import SHIPPED, Standing, standing
from storage.night_report import SynthesisUse


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownRow:
    """One row as it is read; `mark` is empty unless the value is worse than it should be."""

    metric: str
    feature: str
    note: str
    value: str
    interval: str
    real_value: str
    real_interval: str
    aim: str
    standing: str
    mark: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownGroup:
    """Rows that answer the same question, and how to read them."""

    title: str
    words: str
    rows: tuple[ShownRow, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tile:
    """One number to see first."""

    value: str
    words: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ScorecardSection:
    """A scorecard to show.

    Attributes:
        tiles: What to see first: can they be crossed, how many numbers are marked.
        verdict: How many numbers are marked, and where, in one sentence.
        remarks: What was done for small numbers, by the generator and by the scorecard.
        groups: All rows.
    """

    tiles: tuple[Tile, ...]
    verdict: str
    remarks: tuple[str, ...]
    groups: tuple[ShownGroup, ...]


def scorecard_section(scorecard: Scorecard, synthesis: SynthesisUse | None) -> ScorecardSection:
    """Group and word the rows of a scorecard.

    Args:
        scorecard: What was scored.
        synthesis: How the environments came to be, where that is known.
    """
    rows = scorecard.rows
    return ScorecardSection(
        tiles=_tiles(rows),
        verdict=_verdict(rows),
        remarks=(*_synthesis_remarks(synthesis), *_size_remarks(rows)),
        groups=tuple(
            ShownGroup(title=title, words=words, rows=tuple(_shown(row) for row in of_group))
            for title, words in _GROUPS.items()
            if (of_group := [row for row in rows if _group_of(row) == title])
        ),
    )


_CROSSED, _WHOLES, _COPIES, _MEASURES, _DRIVES = (
    "Can they be crossed?",
    "The samples as wholes",
    "Copies",
    "Measures",
    "Drives",
)

_GROUPS = {
    _CROSSED: "A disc of the robot's padded inscribed radius gets from the bottom to the top: of "
    "all samples drawn, and of those handed on.",
    _WHOLES: "Precision and density: do the synthesized lie among the real? Recall and coverage: "
    "do the real lie among the synthesized? MMD\N{SUPERSCRIPT TWO} is a distance of two samples.",
    _COPIES: "Repeats within a sample; copies of what was learned from; memorisation is the chance "
    "to lie nearer to it than a real one of another site does: 1/2 is right, 1 is copying.",
    _MEASURES: "What single environments are like: the mean, and how far the two distributions are "
    "apart (Wasserstein-1), in the measure's own unit.",
    _DRIVES: "How hard they are: one drive through each; a failure counts as 100 s.",
}

_COPY_METRICS = ("near duplicates", "copies", "memorisation")


def _group_of(row: ScorecardRow) -> str:
    if row.metric.startswith("traversable"):
        return _CROSSED
    if row.metric in (*MANIFOLD_METRICS, "MMD^2"):
        return _WHOLES
    if row.metric in _COPY_METRICS:
        return _COPIES
    measure = row.metric.removeprefix("mean ").removeprefix("Wasserstein-1 ")
    return _DRIVES if measure in DRIVEN_MEASURES else _MEASURES


def _shown(row: ScorecardRow) -> ShownRow:
    found = standing(row)
    p_values = ""
    if row.p_value is not None:
        p_values = f"p = {row.p_value:.2g}"
        if row.real_p_value is not None:
            p_values += f", between real ones p = {row.real_p_value:.2g}"
    unit = "" if row.unit in _PLAIN_UNITS else f"{row.unit}; "
    return ShownRow(
        metric=_metric_words(row),
        feature=f"{row.feature}; {unit}{row.n_real:,} real, {row.n_synthesized:,} synthesized",
        note="; ".join(filter(None, (p_values, row.note))),
        value=_number(row.value, row.unit),
        interval=_interval(row.low, row.high, row.unit),
        real_value=_number(row.real_value, row.unit),
        real_interval=_interval(row.real_low, row.real_high, row.unit),
        aim=row.aim,
        standing=_STANDING_WORDS[found],
        mark=found if found in _MARKS else "",
    )


_MARKS: tuple[Standing, ...] = ("too low", "too high")

_STANDING_WORDS = {"within": "within", "unknown": "no ceiling", "too low": "", "too high": ""}

_PLAIN_UNITS = ("share", "share of cells", "chance", "ratio", "m", "s")
"""Units that a number shows itself, or that need no name."""


def _metric_words(row: ScorecardRow) -> str:
    return row.metric.replace("^2", "\N{SUPERSCRIPT TWO}")


def _tiles(rows: Sequence[ScorecardRow]) -> tuple[Tile, ...]:
    crossed = {row.metric: row for row in rows if _group_of(row) == _CROSSED}
    tiles = [
        Tile(value=_number(row.value, row.unit), words=words)
        for metric, words in (
            ("traversable, raw", "of all samples drawn can be crossed"),
            (SHIPPED, "of those handed on"),
        )
        if (row := crossed.get(metric))
    ]
    if shipped := crossed.get(SHIPPED):
        tiles.append(
            Tile(
                value=_number(shipped.real_value, shipped.unit),
                words="of the real ones they are compared with",
            )
        )
    marked, judged = _marked(rows)
    tiles.append(Tile(value=f"{len(marked)} of {judged}", words="numbers marked"))
    return tuple(tiles)


def _marked(rows: Sequence[ScorecardRow]) -> tuple[list[ScorecardRow], int]:
    """Give the rows that are worse than they should be, and how many could be judged."""
    found = [(row, standing(row)) for row in rows]
    judged = sum(one != "unknown" for _, one in found)
    return [row for row, one in found if one in _MARKS], judged


def _verdict(rows: Sequence[ScorecardRow]) -> str:
    marked, judged = _marked(rows)
    if not judged:
        return "There are too few environments for any number to have a ceiling."
    if not marked:
        return (
            f"All numbers that have a ceiling ({judged}) are within what real environments show "
            "among themselves."
        )
    places = []
    for title in _GROUPS:
        ours, of = _marked([row for row in rows if _group_of(row) == title])
        if ours:
            places.append(f'{len(ours)} of {of} under "{title}"')
    return (
        f"{len(marked)} of {judged} numbers that have a ceiling are worse than what real "
        f"environments show among themselves: {', '.join(places)}."
    )


def _synthesis_remarks(synthesis: SynthesisUse | None) -> tuple[str, ...]:
    """Say what the generator did because it had little to learn from."""
    if synthesis is None:
        return ()
    swapped = (
        (f"Made by {synthesis.method_used} instead of {synthesis.method_asked}.",)
        if synthesis.method_used != synthesis.method_asked
        else ()
    )
    return (*swapped, *synthesis.notes)


def _size_remarks(rows: Sequence[ScorecardRow]) -> tuple[str, ...]:
    """Say what numbers of environments mean for the rows."""
    remarks = [
        _HALVES_REMARKS[kind]
        for kind in dict.fromkeys(row.halves.split(" (", 1)[0] for row in rows)
        if kind in _HALVES_REMARKS
    ]
    if any(row.halves.endswith(" (2)") for row in rows):
        remarks.append(
            "Two groups of real ones can be halved in one way only: the real-against-real "
            "intervals are too narrow."
        )
    silent = sum(row.value is None for row in rows)
    if silent:
        remarks.append(f"{silent} of {len(rows)} rows have no value; each says why.")
    return tuple(remarks)


_HALVES_REMARKS = {
    "by log": "Fewer than two sites are known, so real ones are kept apart by log.",
    "by environment": "Fewer than two sites or logs are known, so real ones of one drive are "
    "compared with each other: the real-against-real values are too good.",
}


def _number(value: float | None, unit: str) -> str:
    if value is None:
        return "none"
    if unit in ("m", "s"):
        return f"{_rounded(value)} {unit}"
    return f"{100.0 * value:.1f} %" if unit.startswith("share") else _rounded(value)


def _interval(low: float | None, high: float | None, unit: str) -> str:
    if low is None or high is None:
        return ""
    if unit.startswith("share"):
        return f"{100.0 * low:.1f} to {100.0 * high:.1f}"
    return f"{_rounded(low)} to {_rounded(high)}"


def _rounded(value: float) -> str:
    text = f"{value:,.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"
    return text.replace("-", "\N{MINUS SIGN}")
