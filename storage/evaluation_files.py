"""An evaluation on disk: `episodes.parquet` and `summary.json`."""

import json
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from ses_core.evaluation.comparison import Comparison, compare
from ses_core.evaluation.episodes import Episode, episode_columns
from ses_core.evaluation.statistics import PolicySummary, summarize
from storage.parquet_files import read_table, write_table

EPISODES_FILE = "episodes.parquet"
SUMMARY_FILE = "summary.json"


def write_evaluation(directory: Path, episodes: Sequence[Episode]) -> None:
    """Write episodes and what they amount to into a folder, which is made if it is missing."""
    directory.mkdir(parents=True, exist_ok=True)
    write_table(directory / EPISODES_FILE, "episodes", episode_columns(episodes))
    record = summary_record(summarize(episodes), compare(episodes))
    text = json.dumps(record, indent=2, allow_nan=False) + "\n"
    (directory / SUMMARY_FILE).write_text(text)


def read_episodes(directory: Path) -> list[Episode]:
    """Read the episodes of an evaluation in the order in which they were written.

    Raises:
        SchemaError: The file is missing or does not have the columns of the table.
    """
    columns = [column.name for column in fields(Episode)]
    frame = read_table(directory / EPISODES_FILE, "episodes", columns=columns)
    rows = zip(*(frame[name].tolist() for name in columns), strict=True)
    return [Episode(**dict(zip(columns, row, strict=True))) for row in rows]


def summary_record(
    summaries: Sequence[PolicySummary], comparisons: Sequence[Comparison]
) -> dict[str, Any]:
    """Give the JSON form of an evaluation: `rows` and `comparisons`."""
    return {
        "rows": [asdict(summary) for summary in summaries],
        "comparisons": [asdict(comparison) for comparison in comparisons],
    }
