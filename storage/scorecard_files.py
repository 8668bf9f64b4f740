"""A scorecard on disk: its rows as a table, its distributions beside it, what it is about."""

from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
import pandas as pd

from ses_core.errors import ArtifactError
from ses_core.navigation import NavigationDomain
from ses_core.recipes import JsonValue
from ses_core.scorecard.halving import Grouping, coarsest_grouping
from ses_core.scorecard.result import Measured, Scorecard
from ses_core.scorecard.rows import ScorecardRow
from storage.durable_files import make_folder, replace_file
from storage.environment_files import SYNTHESIS_FILE
from storage.layout import Layout
from storage.night_report import SynthesisUse
from storage.parquet_files import read_table, write_table
from storage.scenario_tables import SCENARIOS_FILE
from storage.stage_records import read_record
from storage.table_reader import open_table

SCORECARD_FILE = "scorecard.parquet"
MEASURES_FILE = "measures.npz"

_SIDES = ("real", "synthesized")


def write_scorecard(directory: Path, rows: Sequence[ScorecardRow]) -> Path:
    """Write rows into a folder, which is made if it is missing; gives the file's path.

    Raises:
        ArtifactError: The disk is full or failing.
    """
    make_folder(directory)
    path = directory / SCORECARD_FILE
    names = [column.name for column in fields(ScorecardRow)]
    write_table(path, "scorecard", {name: [getattr(row, name) for row in rows] for name in names})
    return path


def read_scorecard(directory: Path) -> list[ScorecardRow]:
    """Read the rows of a folder in their order.

    Raises:
        ArtifactError: The file is missing or damaged.
        SchemaError: It is no scorecard.
    """
    names = [column.name for column in fields(ScorecardRow)]
    frame = read_table(directory / SCORECARD_FILE, "scorecard", columns=names)
    # A real number that is unknown opens in pandas as nan.
    columns = [frame[name].astype(object).where(frame[name].notna(), None) for name in names]
    return [
        ScorecardRow(**dict(zip(names, row, strict=True)))
        for row in zip(*(column.tolist() for column in columns), strict=True)
    ]


def place_scorecard(source: Path, folder: Path) -> None:
    """Put the table of one folder into another; without one there, an older one goes away.

    Raises:
        ArtifactError: The disk is full or failing.
    """
    if (source / SCORECARD_FILE).is_file():
        replace_file(folder / SCORECARD_FILE, (source / SCORECARD_FILE).read_bytes())
    else:
        (folder / SCORECARD_FILE).unlink(missing_ok=True)


def write_scored(directory: Path, scorecard: Scorecard) -> None:
    """Write rows and distributions into a folder; equal scorecards give equal bytes.

    Raises:
        ArtifactError: The disk is full or failing.
    """
    write_scorecard(directory, scorecard.rows)
    arrays = {
        f"{name}/{side}": getattr(measured, side)
        for name, measured in scorecard.measures.items()
        for side in _SIDES
    }
    np.savez(directory / MEASURES_FILE, allow_pickle=False, **arrays)


def read_scored(directory: Path) -> Scorecard:
    """Read back what `write_scored` wrote.

    Raises:
        ArtifactError: A file is missing or damaged.
        SchemaError: The table is no scorecard.
    """
    rows = read_scorecard(directory)
    units = {row.metric.removeprefix("mean "): row.unit for row in rows}
    path = directory / MEASURES_FILE
    try:
        with np.load(path, allow_pickle=False) as stored:
            names = dict.fromkeys(name.rsplit("/", 1)[0] for name in stored.files)
            measures = {
                name: Measured(
                    unit=units[name], **{side: stored[f"{name}/{side}"] for side in _SIDES}
                )
                for name in names
            }
    except (OSError, EOFError, ValueError, KeyError, BadZipFile) as error:
        raise ArtifactError(f"{path} holds no measures of a scorecard: {error}") from error
    return Scorecard(rows=tuple(rows), measures=measures)


def row_record(row: ScorecardRow) -> dict[str, JsonValue]:
    """Give the JSON form of a row."""
    return asdict(row)


def group_environments(directory: Path, domain: NavigationDomain, layout: Layout) -> Grouping:
    """Find out which real environments come from the same site, or at least the same log.

    It is looked up by scenario, in a `scenarios.parquet` beside the environments, else in the
    store, if there is one.

    Raises:
        ArtifactError: A table is damaged.
        SchemaError: A file of that name is no such table.
    """
    columns = ["scenario_id", "site", "log_id"]
    beside = directory / SCENARIOS_FILE
    if beside.is_file():
        known = read_table(beside, "scenarios", columns=columns)
    elif layout.store_file.is_file():
        known = open_table(layout.root, "scenarios", columns=columns)
    else:
        known = pd.DataFrame(columns=columns)
    sites = dict(zip(known["scenario_id"], known["site"], strict=True))
    logs = dict(zip(known["scenario_id"], known["log_id"], strict=True))
    scenarios = [environment.scenario_id for environment in domain.environments]
    return coarsest_grouping(
        [sites.get(scenario) for scenario in scenarios],
        [logs.get(scenario) for scenario in scenarios],
        count=len(scenarios),
    )


def read_synthesis_use(directory: Path) -> SynthesisUse | None:
    """Tell how the environments of a folder came to be, where a record of it lies there.

    Raises:
        ArtifactError: The record cannot be read.
    """
    record = directory / SYNTHESIS_FILE
    return read_record(record, SynthesisUse) if record.is_file() else None


def raw_traversable_share(directory: Path) -> float | None:
    """Give the share of all draws that could be crossed, where a record of them lies there.

    Raises:
        ArtifactError: The record cannot be read.
    """
    used = read_synthesis_use(directory)
    return None if used is None else 1.0 - used.rejected_share
