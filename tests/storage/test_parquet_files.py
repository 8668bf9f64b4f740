from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ses_core.errors import ArtifactError, SchemaError
from storage.parquet_files import read_arrow, read_table, row_count, write_empty_table, write_table
from storage.table_schemas import TABLES
from tests.storage.sample_tables import sample_columns


@pytest.mark.parametrize("table", TABLES)
def test_every_table_reads_back_what_was_written(tmp_path: Path, table: str) -> None:
    columns = sample_columns(table)
    write_table(tmp_path / "rows.parquet", table, columns)
    rows = read_arrow(tmp_path / "rows.parquet", table)
    assert row_count(tmp_path / "rows.parquet") == 3
    for name, values in columns.items():
        found = rows[name].to_pylist()
        if name in ("cells", "observed", "ranges_m"):
            np.testing.assert_array_equal(np.array(found), np.asarray(values).reshape(3, -1))
        elif isinstance(values, np.ndarray):
            np.testing.assert_array_equal(np.array(found), values)
        else:
            assert found == list(values)


@pytest.mark.parametrize("table", TABLES)
def test_plain_pandas_reads_the_same_types_with_and_without_rows(
    tmp_path: Path, table: str
) -> None:
    write_empty_table(tmp_path / "000.parquet", table)
    empty = pd.read_parquet(tmp_path)
    write_table(tmp_path / "rows.parquet", table, sample_columns(table))
    full = pd.read_parquet(tmp_path)
    assert len(empty) == 0
    assert len(full) == 3
    assert empty.dtypes.to_dict() == full.dtypes.to_dict()


def test_an_unknown_count_is_null_and_never_a_number(tmp_path: Path) -> None:
    write_table(tmp_path / "a.parquet", "scenarios", sample_columns("scenarios"))
    counts = pd.read_parquet(tmp_path / "a.parquet")["negative_velocity_count"]
    assert counts.dtype == "Int64"
    assert counts.isna().tolist() == [False, False, True]
    assert counts[1] == 51


def test_nan_stays_nan_also_from_pandas(tmp_path: Path) -> None:
    columns = dict(sample_columns("trajectories"))
    columns["measured_v_mps"] = pd.Series([0.5, np.nan, 1.0])
    write_table(tmp_path / "a.parquet", "trajectories", columns)
    rows = read_arrow(tmp_path / "a.parquet", "trajectories")
    assert rows["measured_v_mps"].null_count == 0


def test_scans_of_different_lengths_are_kept(tmp_path: Path) -> None:
    columns = dict(sample_columns("scans"))
    columns["ranges_m"] = [[1.0, np.inf], [], [2.5]]
    write_table(tmp_path / "a.parquet", "scans", columns)
    ranges = read_table(tmp_path / "a.parquet", "scans")["ranges_m"]
    assert [list(values) for values in ranges] == [[1.0, np.inf], [], [2.5]]


def test_nullable_columns_that_are_left_out_are_null(tmp_path: Path) -> None:
    columns = {
        name: values
        for name, values in sample_columns("scenarios").items()
        if name not in ("outcome", "not_forward_count", "reversing_s")
    }
    write_table(tmp_path / "a.parquet", "scenarios", columns)
    rows = read_table(tmp_path / "a.parquet", "scenarios")
    assert rows[["outcome", "not_forward_count", "reversing_s"]].isna().all(axis=None)


def test_a_column_that_is_missing_or_unknown_is_named(tmp_path: Path) -> None:
    columns = dict(sample_columns("logs"))
    del columns["site"]
    columns["sight"] = columns["name"]
    with pytest.raises(SchemaError, match=r"unknown columns \['sight'\] and lacks .*'site'"):
        write_table(tmp_path / "a.parquet", "logs", columns)


@pytest.mark.parametrize(
    ("column", "values"),
    [
        ("steps", ["many", "few", "none"]),
        ("steps", [1, None, 2]),
        ("steps", [1, 2]),
        ("steps", [1, 2, 2**63]),
        ("name", [1, 2, 3]),
    ],
)
def test_values_that_do_not_fit_are_refused_by_name(
    tmp_path: Path, column: str, values: list[object]
) -> None:
    with pytest.raises(SchemaError, match=column):
        write_table(tmp_path / "a.parquet", "logs", {**sample_columns("logs"), column: values})
    assert list(tmp_path.iterdir()) == []


def test_cells_of_another_shape_are_refused(tmp_path: Path) -> None:
    columns = {**sample_columns("environments"), "cells": np.zeros((3, 30, 29), dtype=np.bool_)}
    with pytest.raises(SchemaError, match="870 values, expected 900"):
        write_table(tmp_path / "a.parquet", "environments", columns)


def test_files_of_other_tables_releases_and_makers_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    write_table(path, "selections", sample_columns("selections"))
    with pytest.raises(SchemaError, match="is no logs table: it differs in"):
        read_table(path, "logs")
    with pytest.raises(SchemaError, match="no table is called 'log'"):
        read_table(path, "log")
    with pytest.raises(SchemaError, match="has no column 'rang'"):
        read_table(path, "selections", ["rang"])
    rows = pq.read_table(path)
    newer = rows.replace_schema_metadata({**rows.schema.metadata, b"ses.schema_version": b"2"})
    pq.write_table(newer, path)
    with pytest.raises(SchemaError, match="version 2, this release knows versions up to 1"):
        read_table(path, "selections")
    pq.write_table(pa.table({"x": [1]}), path)
    with pytest.raises(SchemaError, match="none of our tables"):
        read_table(path, "selections")


def test_reading_what_is_not_there_names_it(tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match=r"absent\.parquet is missing"):
        read_table(tmp_path / "absent.parquet", "logs")


def test_equal_rows_make_equal_bytes(tmp_path: Path) -> None:
    for name in ("a.parquet", "b.parquet"):
        write_table(tmp_path / name, "scans", sample_columns("scans"))
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()


def test_a_file_cut_anywhere_is_found(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    write_table(path, "scenarios", sample_columns("scenarios"))
    content = path.read_bytes()
    for length in range(0, len(content), 61):
        path.write_bytes(content[:length])
        with pytest.raises(ArtifactError, match="damaged"):
            read_table(path, "scenarios")


def test_flipped_bits_in_pages_are_found_without_the_store(tmp_path: Path) -> None:
    """Page checksums alone; the store's digests also cover the footer."""
    path = tmp_path / "a.parquet"
    rng = np.random.default_rng(3)
    columns = {
        **sample_columns("trajectories"),
        "x_m": rng.normal(size=3),
    }
    write_table(path, "trajectories", columns)
    content = path.read_bytes()
    metadata = pq.read_metadata(path).row_group(0)
    for number in range(metadata.num_columns):
        chunk = metadata.column(number)
        start = chunk.dictionary_page_offset or chunk.data_page_offset
        last_byte = start + chunk.total_compressed_size - 1
        damaged = bytearray(content)
        damaged[last_byte] ^= 4
        path.write_bytes(damaged)
        with pytest.raises(ArtifactError, match="damaged"):
            read_table(path, "trajectories")


@settings(max_examples=25, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.text(max_size=8),
            st.integers(-(2**63), 2**63 - 1),
            st.floats(width=64),
            st.one_of(st.none(), st.integers(-(2**63), 2**63 - 1)),
        ),
        min_size=1,
        max_size=5,
    )
)
def test_any_rows_read_back_equal(
    tmp_path_factory: pytest.TempPathFactory,
    rows: list[tuple[str, int, float, int | None]],
) -> None:
    path = tmp_path_factory.mktemp("rows") / "a.parquet"
    texts, numbers, reals, counts = (list(values) for values in zip(*rows, strict=True))
    columns = {
        name: [values[0]] * len(rows) for name, values in sample_columns("scenarios").items()
    }
    columns |= {
        "robot": texts,
        "start_stamp_ns": numbers,
        "arc_length_m": reals,
        "negative_velocity_count": counts,
    }
    write_table(path, "scenarios", columns)
    found = read_arrow(path, "scenarios")
    assert found["robot"].to_pylist() == texts
    assert found["start_stamp_ns"].to_pylist() == numbers
    np.testing.assert_array_equal(found["arc_length_m"].to_numpy(), np.array(reals))
    assert found["negative_velocity_count"].to_pylist() == counts
