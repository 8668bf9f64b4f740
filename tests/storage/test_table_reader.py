from datetime import date
from pathlib import Path

import numpy as np
import pytest

from ses_core.errors import ArtifactError, SchemaError
from storage.artifact_store import LocalArtifactStore
from storage.table_log import TableLog
from storage.table_reader import open_table
from tests.storage.sample_tables import commit_sample

DAYS = {"a": date(2026, 11, 1), "b": date(2026, 11, 2), "c": date(2026, 11, 3)}


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three logs on three days, each with a row of every site."""
    root = tmp_path_factory.mktemp("store")
    store = LocalArtifactStore(root)
    log = TableLog(store.layout)
    for tag, day in DAYS.items():
        commit_sample(store, log, tag, day=day)
    return root


@pytest.mark.parametrize("table", ["logs", "trajectories", "scans", "scenarios"])
def test_dates_are_both_included(root: Path, table: str) -> None:
    ids = open_table(root, table, since=DAYS["b"], until=DAYS["b"])["log_id"]
    assert set(ids) == {"b-0", "b-1", "b-2"}
    assert len(open_table(root, table, since=DAYS["b"])) == 6
    assert len(open_table(root, table, until=DAYS["b"])) == 6
    assert len(open_table(root, table, since=date(2027, 1, 1))) == 0


@pytest.mark.parametrize("table", ["logs", "trajectories", "scans", "scenarios"])
def test_sites_are_filtered_also_where_only_the_log_knows_them(root: Path, table: str) -> None:
    rows = open_table(root, table, sites=["office", "nowhere"], since=DAYS["b"])
    assert set(rows["log_id"]) == {"b-1", "c-1"}


@pytest.mark.parametrize("table", ["environments", "selections"])
def test_rows_of_scenarios_are_filtered_through_them(root: Path, table: str) -> None:
    assert set(open_table(root, table, sites=["yard"])["scenario_id"]) == {"a-2", "b-2", "c-2"}
    assert len(open_table(root, table, until=DAYS["a"])) == 3


def test_cells_are_squares_with_the_goal_edge_first(root: Path) -> None:
    rows = open_table(root, "environments", columns=["cells", "environment_id"])
    assert list(rows.columns) == ["cells", "environment_id"]
    assert {cells.shape for cells in rows["cells"]} == {(30, 30)}
    assert [np.argwhere(cells).tolist() for cells in rows["cells"][:3]] == [[], [[0, 29]], []]
    assert rows["cells"].iloc[0].dtype == np.uint8


def test_columns_that_only_the_filter_needs_do_not_show(root: Path) -> None:
    rows = open_table(root, "scenarios", sites=["home"], columns=["kind"])
    assert list(rows.columns) == ["kind"]
    assert len(rows) == 3


def test_tables_without_days_or_sites_say_so(root: Path) -> None:
    assert len(open_table(root, "episodes")) == 9
    with pytest.raises(ValueError, match="episodes cannot be filtered"):
        open_table(root, "episodes", sites=["home"])


def test_unknown_tables_and_columns_are_named(root: Path) -> None:
    with pytest.raises(SchemaError, match="'scenario'"):
        open_table(root, "scenario")
    with pytest.raises(SchemaError, match="'lenght'"):
        open_table(root, "scenarios", columns=["lenght"])


def test_a_folder_that_is_no_store_is_left_as_it_is(tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match="holds no store"):
        open_table(tmp_path, "logs")
    assert list(tmp_path.iterdir()) == []
