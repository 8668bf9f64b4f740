from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ses_core.errors import ArtifactError, SchemaError
from ses_core.navigation import NavigationDomain, NavigationEnvironment
from ses_core.scorecard.rows import ScorecardRow
from storage.artifact_store import LocalArtifactStore
from storage.layout import Layout
from storage.parquet_files import read_arrow, write_table
from storage.scorecard_files import (
    MEASURES_FILE,
    SCORECARD_FILE,
    group_environments,
    place_scorecard,
    raw_traversable_share,
    read_scorecard,
    read_scored,
    write_scorecard,
    write_scored,
)
from storage.table_log import TableLog
from storage.table_schemas import SCHEMA_VERSION, VERSION_KEY
from tests.ses_core.scorecard.samples import pillars, score
from tests.storage.sample_tables import commit_sample, sample_columns

ROWS = [
    ScorecardRow(
        metric="coverage",
        feature="cells (Hamming), k=5",
        unit="share",
        aim="high",
        value=0.5,
        low=0.4,
        high=0.6,
        real_value=0.9,
        n_real=30,
        n_synthesized=30,
        halves="by site (4)",
    ),
    ScorecardRow(
        metric="MMD^2",
        feature="cells",
        unit="squared kernel distance",
        aim="low",
        p_value=0.01,
        n_real=0,
        n_synthesized=0,
        halves="by environment (0)",
        note="too few",
    ),
]


def places(*scenarios: str) -> NavigationDomain:
    """Make empty recorded environments of scenarios."""
    cells = np.zeros((30, 30), dtype=np.bool_)
    return NavigationDomain(
        tuple(
            NavigationEnvironment(
                environment_id=f"e{number}",
                cells=cells,
                observed=cells,
                origin="scan",
                scenario_id=scenario,
            )
            for number, scenario in enumerate(scenarios)
        )
    )


@pytest.mark.parametrize("rows", [ROWS, ROWS[1:], []])
def test_reading_gives_back_what_was_written(rows: list[ScorecardRow], tmp_path: Path) -> None:
    write_scorecard(tmp_path / "new", rows)
    assert read_scorecard(tmp_path / "new") == rows


def test_plain_pandas_reads_it_and_it_carries_the_schema_version(tmp_path: Path) -> None:
    path = write_scorecard(tmp_path, ROWS)
    frame = pd.read_parquet(path)
    assert frame["value"].isna().tolist() == [False, True]
    assert frame["halves"].tolist() == ["by site (4)", "by environment (0)"]
    metadata = read_arrow(path, "scorecard").schema.metadata
    assert metadata[VERSION_KEY] == str(SCHEMA_VERSION).encode()


def test_another_table_of_that_name_is_refused(tmp_path: Path) -> None:
    write_table(tmp_path / SCORECARD_FILE, "scenarios", sample_columns("scenarios"))
    with pytest.raises(SchemaError, match="is no scorecard table"):
        read_scorecard(tmp_path)


def test_distributions_come_back_in_their_order_with_their_units(tmp_path: Path) -> None:
    found = score(pillars(12, seed=0), pillars(6, seed=1))
    for name in ("one", "two"):
        write_scored(tmp_path / name, found)
    again = read_scored(tmp_path / "one")
    assert again.rows == found.rows
    assert list(again.measures) == list(found.measures)
    for name, measured in found.measures.items():
        assert again.measures[name].unit == measured.unit
        np.testing.assert_array_equal(again.measures[name].real, measured.real)
        np.testing.assert_array_equal(again.measures[name].synthesized, measured.synthesized)
    files = [(tmp_path / name / MEASURES_FILE).read_bytes() for name in ("one", "two")]
    assert files[0] == files[1]


def test_damaged_distributions_are_an_error_that_names_the_file(tmp_path: Path) -> None:
    write_scored(tmp_path, score(pillars(3, seed=0), pillars(3, seed=1)))
    for content in (b"", b"PK no more", (tmp_path / MEASURES_FILE).read_bytes()[:900]):
        (tmp_path / MEASURES_FILE).write_bytes(content)
        with pytest.raises(ArtifactError, match=r"measures\.npz holds no measures"):
            read_scored(tmp_path)


def test_a_folder_keeps_no_scorecard_of_an_earlier_night(tmp_path: Path) -> None:
    source, empty, folder = (tmp_path / name for name in ("source", "empty", "folder"))
    write_scorecard(source, ROWS)
    place_scorecard(source, folder)
    assert read_scorecard(folder) == ROWS
    place_scorecard(empty, folder)
    place_scorecard(empty, folder)
    assert not list(folder.iterdir())


def test_sites_and_logs_come_from_the_scenarios_beside(tmp_path: Path) -> None:
    domain = places("s0", "s1", "s2")
    nowhere = Layout(tmp_path / "none")
    assert group_environments(tmp_path, domain, nowhere).named() == "by environment (3)"
    columns = dict(sample_columns("scenarios"))
    columns |= {"scenario_id": ["s2", "s1", "s0"], "log_id": ["l2", "l1", "l1"]}
    write_table(tmp_path / "scenarios.parquet", "scenarios", columns | {"site": ["b", "a", "a"]})
    by_site = group_environments(tmp_path, domain, nowhere)
    assert (by_site.named(), by_site.labels.tolist()) == ("by site (2)", [0, 0, 1])
    write_table(tmp_path / "scenarios.parquet", "scenarios", columns | {"site": ["a"] * 3})
    assert group_environments(tmp_path, domain, nowhere).named() == "by log (2)"


def test_sites_come_from_the_store_where_nothing_lies_beside(tmp_path: Path) -> None:
    store = LocalArtifactStore(tmp_path / "store")
    commit_sample(store, TableLog(store.layout), "a")
    found = group_environments(tmp_path, places("a-2", "a-0", "a-2"), store.layout)
    assert (found.named(), found.labels.tolist()) == ("by site (2)", [1, 0, 1])
    unknown = group_environments(tmp_path, places("a-2", "b-0", "a-1"), store.layout)
    assert unknown.named() == "by environment (3)"


def test_without_a_record_of_the_draws_the_raw_share_is_unknown(tmp_path: Path) -> None:
    assert raw_traversable_share(tmp_path) is None
    (tmp_path / "synthesis.json").write_text(
        '{"method_asked": "gan", "method_used": "gan", "drawn": 10, "rejected_share": 0.25, '
        '"repeated": 0, "copied": 0, "notes": []}'
    )
    assert raw_traversable_share(tmp_path) == 0.75
